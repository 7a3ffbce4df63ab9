"""Stepwise selection of causes.

Calibrate, find the noise floor of the case, test every candidate, and accept one cause after another.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from etb_hil.discrepancy.candidates.nonparametric import NonparametricTerm, beyond_tolerances, nonparametric_terms
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.fitting.noise_floor import group_means
from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.bench_numbers import accept_measured
from etb_hil.discrepancy.search.current_model import accept, current_model_near
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.discrepancy.search.first_slide import after_first_slide
from etb_hil.discrepancy.search.force_scale import consider_force_scale
from etb_hil.discrepancy.search.interruption import Interrupted
from etb_hil.discrepancy.search.joint_causes import (
    accept_by_replacing,
    accept_if_jointly_significant,
    accept_with_another,
)
from etb_hil.discrepancy.search.reconsideration import consider_drift, drop_if_idle, reconsider
from etb_hil.discrepancy.search.rejection import is_rejected_as_shared_only, reason_to_reject
from etb_hil.discrepancy.search.selection import Progress, accepted_ids, selection_step
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.parameters import Model

_MOST_CAUSES = 3
_ITERATIONS = 10  # of the calibration, before anything is tested


def search(
    model: Model, balances: Sequence[Balances], without: Sequence[str] = (), progress: Progress = lambda _: None
) -> Findings:
    """Search for what a model lacks in its measurements; `without`: ids not tested.

    An interrupt after the calibration ends the search with what it knows; right after it, as `Interrupted`.
    """
    segments, stated = list(balances), model.as_stated()
    progress("calibrating inside the stated tolerances")
    calibration = calibrate(stated, segments)
    progress("simulating the residual of a true model")
    try:
        current_model = current_model_near(stated, segments, calibration.fit.whole, calibration.unknowns, _ITERATIONS)
        current_model = after_first_slide(stated, segments, current_model, _ITERATIONS)
    except KeyboardInterrupt:
        raise Interrupted(calibration) from None
    calibration = current_model.calibration
    samples = group_means(segments, calibration.fit.whole)[1]
    findings = Findings(
        model, segments, calibration, current_model.noise_floor, [], current_model, current_model.groups, samples
    )
    with _interruptible(findings):
        _look(findings, [*without, *(entry.id for entry in model.effects)], progress)
        consider_drift(findings)
        consider_force_scale(findings)
    with _interruptible(findings):
        findings.rest = _rest(findings)
        findings.curve = _curve(findings)
    findings.verdict = decision.verdict(findings)
    return findings


@contextmanager
def _interruptible(findings: Findings) -> Iterator[None]:
    """Let an interrupt end a part of the search, and keep what is known."""
    try:
        yield
    except KeyboardInterrupt:
        findings.is_interrupted = True


def _rest(findings: Findings) -> list[NonparametricTerm]:
    """Return what nonparametric terms explain of the residual, largest first."""
    final = findings.final
    found = nonparametric_terms(findings.balances, final.fit.whole[:EXTENDED], final.jacobian, final.fit.residual)
    found.append(beyond_tolerances(final.jacobian, final.fit, final.unknowns))
    return sorted(found, key=lambda nameless: -nameless.share)


def _curve(findings: Findings) -> float:
    """Return the largest share of a nonparametric term given parametric faults alone."""
    if not findings.accepted or any(found.winner.candidate.effect for found in findings.accepted):
        return 0.0
    final = findings.final
    groups = np.concatenate([b.judged_groups() for b in findings.balances])
    counts = (groups >= 0) & ~decision.LOOSE[np.maximum(groups, 0)]
    found = nonparametric_terms(
        findings.balances, final.fit.whole[:EXTENDED], final.jacobian, final.fit.residual, counts
    )
    return max((spline.share for spline in found), default=0.0)


def _look(findings: Findings, without: Sequence[str], progress: Progress) -> None:
    """Accept what was measured at the bench, and then one cause after another."""
    if accept_measured(findings) and not decision.is_more_missing(findings):
        return
    without = list(without)
    while len(findings.accepted) < _MOST_CAUSES:
        found = selection_step(findings, [*without, *accepted_ids(findings.accepted)], progress)
        findings.selection_steps.append(found)
        found.rejection = reason_to_reject(found, findings)
        if not found.rejection:
            accept(findings, found)
            if drop_if_idle(findings, found):
                without.append(found.winner.id)
        elif (
            accept_by_replacing(found, findings, without, progress)
            or accept_if_jointly_significant(found, findings, without, progress)
            or (len(findings.accepted) + 2 <= _MOST_CAUSES and accept_with_another(found, findings, without, progress))
        ):
            found.rejection = ""
        elif is_rejected_as_shared_only(found, findings):
            accept(findings, found)  # the doubt stays: what is named beside it is named without confidence
        else:
            _share_ambiguity_groups(findings, found)
            return
        if not findings.accepted:
            continue
        if decision.is_more_missing(findings):
            reconsider(findings, without, progress)
        if not decision.is_more_missing(findings):
            return


def _share_ambiguity_groups(findings: Findings, rejection: SelectionStep) -> None:
    """Add a rejected candidate to the ambiguity groups of causes in its own."""
    for each in findings.accepted:
        if each.winner.id in rejection.ambiguity_group and rejection.winner.id not in each.ambiguity_group:
            each.ambiguity_group.append(rejection.winner.id)
