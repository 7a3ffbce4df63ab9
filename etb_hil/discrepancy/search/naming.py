"""The loop: calibrate, find the case's own noise floor, try every candidate, and take in one effect after another."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.fitting.floor import group_means
from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.beginning import since_it_slid
from etb_hil.discrepancy.search.byhand import take_measured
from etb_hil.discrepancy.search.cut_short import CutShort
from etb_hil.discrepancy.search.driving_force import doubt_force
from etb_hil.discrepancy.search.findings import Findings, Round
from etb_hil.discrepancy.search.objections import is_doubted, objection
from etb_hil.discrepancy.search.reconsidering import ask_again, doubt_drifts, is_given_up
from etb_hil.discrepancy.search.rounds import Progress, one_round, taken_by
from etb_hil.discrepancy.search.standing import standing_near, take_in
from etb_hil.discrepancy.search.together import stands_beside_its_rival, stands_in_place, stands_with_another
from etb_hil.discrepancy.suspects.placeholders import Placeholder, beyond_tolerances, placeholders
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.parameters import Model

_MOST_CAUSES = 3
_ROUNDS = 10  # of the calibration, before anything is suspected


def search(
    model: Model, balances: Sequence[Balances], without: Sequence[str] = (), progress: Progress = lambda _: None
) -> Findings:
    """Look for what a model leaves out of its measurements; `without`: ids that are no candidates.

    An interrupt after the calibration ends the search with what it knows; right after it, as `CutShort`.
    """
    stretches, stated = list(balances), model.as_stated()
    progress("calibrating inside the stated tolerances")
    calibration = calibrate(stated, stretches)
    progress("simulating what a true model would leave")
    try:
        standing = standing_near(stated, stretches, calibration.fit.whole, calibration.unknowns, _ROUNDS)
        standing = since_it_slid(stated, stretches, standing, _ROUNDS)
    except KeyboardInterrupt:
        raise CutShort(calibration) from None
    calibration = standing.calibration
    rows = group_means(stretches, calibration.fit.whole)[1]
    findings = Findings(model, stretches, calibration, standing.floor, [], standing, standing.groups, rows)
    with _cut_short(findings):
        _look(findings, [*without, *(entry.id for entry in model.effects)], progress)
        doubt_drifts(findings)
        doubt_force(findings)
    with _cut_short(findings):
        findings.rest = _rest(findings)
        findings.curve = _curve(findings)
    findings.verdict = decision.verdict(findings)
    return findings


@contextmanager
def _cut_short(findings: Findings) -> Iterator[None]:
    """Let an interrupt end a part of the search: what is known so far is worth having."""
    try:
        yield
    except KeyboardInterrupt:
        findings.is_cut_short = True


def _rest(findings: Findings) -> list[Placeholder]:
    """Return what nameless splines take of the residual, the greediest first."""
    final = findings.final
    found = placeholders(findings.balances, final.fit.whole[:EXTENDED], final.columns, final.fit.residual)
    found.append(beyond_tolerances(final.columns, final.fit, final.unknowns))
    return sorted(found, key=lambda nameless: -nameless.share)


def _curve(findings: Findings) -> float:
    """Return the largest share that a nonparametric term explains given parametric faults."""
    if not findings.accepted or any(found.winner.candidate.effect for found in findings.accepted):
        return 0.0
    final = findings.final
    groups = np.concatenate([b.judged_groups() for b in findings.balances])
    counts = (groups >= 0) & ~decision.LOOSE[np.maximum(groups, 0)]
    found = placeholders(findings.balances, final.fit.whole[:EXTENDED], final.columns, final.fit.residual, counts)
    return max((spline.share for spline in found), default=0.0)


def _look(findings: Findings, without: Sequence[str], progress: Progress) -> None:
    """Take in what was found at the bench, and then one cause after another."""
    if take_measured(findings) and not decision.is_more_missing(findings):
        return
    without = list(without)
    while len(findings.accepted) < _MOST_CAUSES:
        found = one_round(findings, [*without, *taken_by(findings.accepted)], progress)
        findings.rounds.append(found)
        found.refused = objection(found, findings)
        if not found.refused:
            take_in(findings, found)
            if is_given_up(findings, found):
                without.append(found.winner.id)
        elif (
            stands_in_place(found, findings, without, progress)
            or stands_beside_its_rival(found, findings, without, progress)
            or (len(findings.accepted) + 2 <= _MOST_CAUSES and stands_with_another(found, findings, without, progress))
        ):
            found.refused = ""
        elif is_doubted(found, findings):
            take_in(findings, found)  # the doubt stays: what is named beside it is named without confidence
        else:
            _share_classes(findings, found)
            return
        if not findings.accepted:
            continue
        if decision.is_more_missing(findings):
            ask_again(findings, without, progress)
        if not decision.is_more_missing(findings):
            return


def _share_classes(findings: Findings, refused: Round) -> None:
    """Put a refused candidate into the class of each cause that it cannot be told from, whichever was asked."""
    for each in findings.accepted:
        if each.winner.id in refused.alike and refused.winner.id not in each.alike:
            each.alike.append(refused.winner.id)
