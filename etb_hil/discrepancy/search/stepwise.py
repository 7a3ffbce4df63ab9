"""The search for what a model lacks in its measurements.

Calibrate by the balances, find the noise floor of the case, and accept the causes that the likelihood finds. Where they
explain nothing, bristles of the other law may.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from etb_hil.discrepancy.candidates.candidate import candidates_for
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.fitting.noise_floor import group_means
from etb_hil.discrepancy.search.bench_numbers import accept_measured
from etb_hil.discrepancy.search.causes import accept_likely
from etb_hil.discrepancy.search.current_model import after_first_slide, current_model_near
from etb_hil.discrepancy.search.findings import Findings
from etb_hil.discrepancy.search.force_scale import consider_force_scale
from etb_hil.discrepancy.search.interruption import Interrupted
from etb_hil.discrepancy.search.thresholds import excess
from etb_hil.estimation.filtering import filtered
from etb_hil.hypotheses.constants import GAIN
from etb_hil.hypotheses.misfit import misfit
from etb_hil.plant.model_file import FrictionModel
from etb_hil.plant.parameters import Model

Progress = Callable[[str], None]

_ITERATIONS = 10  # of the calibration, before anything is tested


def search(
    model: Model, balances: Sequence[Balances], without: Sequence[str] = (), progress: Progress = lambda _: None
) -> Findings:
    """Search for what a model lacks in its measurements; `without`: ids not tested.

    By which law bristles bend is no fault of a unit: where a model with LuGre's is unexplained, one with elasto-plastic
    bristles is searched, too, and taken if it is likelier and explained. Where a drift of friction leaves nothing,
    bristles have nothing to explain.

    An interrupt after the calibration ends the search with what it knows; right after it, as `Interrupted`.
    """
    findings = _searched(model, balances, without, progress)
    if findings.verdict != "unexplained" or findings.is_interrupted or not _may_have_other_bristles(model):
        return findings
    if findings.found is not None and misfit(findings.found.final).is_nothing:
        return findings
    progress("trying elasto-plastic bristles")
    other = replace(model, friction_model=FrictionModel.ELASTO_PLASTIC)
    try:
        others = _searched(other, [Balances(b.measured, other) for b in balances], without, progress)
    except KeyboardInterrupt:
        findings.is_interrupted = True
        return findings
    findings.is_interrupted = others.is_interrupted
    if others.is_interrupted or others.verdict == "unexplained" or not _is_likelier(others, findings):
        return findings
    others.has_other_bristles = True
    return others


def _may_have_other_bristles(model: Model) -> bool:
    return model.device.is_throttle and model.friction_model is FrictionModel.LUGRE


def _is_likelier(findings: Findings, others: Findings) -> bool:
    """Tell whether the calibrated model of some findings is the likelier one."""
    if findings.found is None or others.found is None:
        return False
    its, theirs = findings.found.calibrated, others.found.calibrated
    # Each search chooses samples of its own: likelihoods are compared on the same ones.
    likelihood = filtered(others.found.record, its.parameters, its.disturbance).log_likelihood
    return likelihood > theirs.filtered.log_likelihood + GAIN


def _searched(model: Model, balances: Sequence[Balances], without: Sequence[str], progress: Progress) -> Findings:
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
    findings = Findings(model, segments, calibration, [], current_model, current_model.groups, samples)
    out = [*without, *(entry.id for entry in model.effects)]
    try:
        findings.tested = candidates_for(segments, calibration.unknowns, out)
        accept_measured(findings)
        findings.verdict = accept_likely(findings, out, progress)
        consider_force_scale(findings)
    except KeyboardInterrupt:  # what is known by then holds
        findings.is_interrupted = True
        is_left = excess(findings.first_groups, findings.samples).any()
        findings.verdict = "unexplained" if is_left else "insufficient_data"
    return findings
