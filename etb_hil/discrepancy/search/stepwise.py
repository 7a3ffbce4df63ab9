"""The search for what a model lacks in its measurements.

Calibrate by the balances, find the noise floor of the case, and accept the causes that the likelihood finds. Where a
residual remains, bristles of another law may explain it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from etb_hil.discrepancy.candidates.candidate import candidates_for
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.fitting.noise_floor import group_means
from etb_hil.discrepancy.search.bench_numbers import accept_measured
from etb_hil.discrepancy.search.bristle_law import elasto_plastic, is_likelier, likeliest_law, named
from etb_hil.discrepancy.search.causes import accept_likely
from etb_hil.discrepancy.search.current_model import after_first_slide, current_model_near
from etb_hil.discrepancy.search.findings import Bristles, Findings
from etb_hil.discrepancy.search.force_scale import consider_force_scale
from etb_hil.discrepancy.search.interruption import Interrupted
from etb_hil.discrepancy.search.thresholds import excess
from etb_hil.hypotheses.misfit import misfit
from etb_hil.plant.parameters import Model

Progress = Callable[[str], None]

_ITERATIONS = 10  # of the calibration, before anything is tested


def search(
    model: Model, balances: Sequence[Balances], without: Sequence[str] = (), progress: Progress = lambda _: None
) -> Findings:
    """Search for what a model lacks in its measurements; `without`: ids not tested.

    Where a residual remains by the law of the model's bristles, the record is searched by another law, too. The second
    answer is taken if it is likelier and differs from the first, unless neither explains the record.

    An interrupt after the calibration ends the search with what it knows; right after it, as `Interrupted`.
    """
    findings = _searched(model, balances, without, progress)
    if findings.is_interrupted or findings.verdict == "adequate":
        return findings
    if findings.found is None or misfit(findings.found.final).is_nothing:
        return findings
    other = elasto_plastic(model)
    try:
        progress("trying bristles of another law")
        law = likeliest_law(findings, other)
        if law is None:
            return findings
        others = _searched(other, [Balances(b.measured, other) for b in balances], without, progress, law)
        findings.is_interrupted = others.is_interrupted
        if others.is_interrupted or _say_the_same(findings, others) or not is_likelier(findings, others):
            return findings
    except KeyboardInterrupt:
        findings.is_interrupted = True
        return findings
    return others


def _say_the_same(findings: Findings, others: Findings) -> bool:
    """Tell whether findings by two laws of bristles need no word about these."""
    if "unexplained" in (findings.verdict, others.verdict):
        return findings.verdict == others.verdict
    return named(findings) == named(others)


def _searched(
    model: Model,
    balances: Sequence[Balances],
    without: Sequence[str],
    progress: Progress,
    bristles: Bristles = Bristles.AS_STATED,
) -> Findings:
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
        model, segments, calibration, [], current_model, current_model.groups, samples, bristles=bristles
    )
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
