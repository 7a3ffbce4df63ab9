"""The head of the page of an explanation: verdict, reason and remarks."""

from __future__ import annotations

from etb_hil.report.explain_values import at_shaft, words
from etb_hil.report.residual_text import residual_text
from etb_hil.report.tolerance_hints import tolerance_hints
from etb_hil.results.explained.causes import MeasuredParameter
from etb_hil.results.explanation import ExplanationResult

TONES = {
    "adequate": "good",
    "explained": "good",
    "ambiguous": "unsure",
    "unexplained": "bad",
    "insufficient_data": "unsure",
}
_REASONS = {
    "adequate": "The model describes these data within the noise of the sensors.",
    "explained": "The causes below explain the errors of the model.",
    "ambiguous": "These data cannot distinguish some causes: each of those named together is possible.",
    "unexplained": "The model lacks an effect that no known cause explains.",
    "insufficient_data": "These data do not suffice to judge the model.",
}
_CUT_SHORT = "The search was interrupted: causes that were not tried yet remain possible."
_IN_PART = "The causes below explain a part of the errors; no known cause explains the rest."
_BUT_FOR = "The model describes these data within the noise of the sensors, but for what follows."
_BY_RUNS = (
    "These data are sampled too slowly to name causes. The model was fitted to some runs and simulated on the others "
    "from the voltage alone. Its error there exceeds the sensor's noise: the model lacks an effect."
)
_ADEQUATE_BY_RUNS = (
    "Simulated from the voltage alone, the model follows runs that were not used in the fit within the sensor's noise."
)


def named_causes(found: ExplanationResult) -> str:
    """Return the causes that an answer names, each with all that it may be.

    An answer that names none gives an empty text.
    """
    if found.verdict not in ("explained", "ambiguous"):
        return ""
    groups: dict[tuple[str, ...], list[str]] = {}
    for one in found.causes:
        groups.setdefault(one.not_isolable_from, []).append(words(one.id))
    names = "; ".join(" or ".join((" and ".join(ids), *map(words, others))) for others, ids in groups.items())
    return f"{one_component(found)} {_capital(names)}.".lstrip()


def one_component(found: ExplanationResult) -> str:
    """Return in a sentence the component that all indistinguishable causes sit in."""
    if found.verdict != "ambiguous" or not found.component:
        return ""
    return f"All possible causes sit in one component: {found.component}."


def reason(found: ExplanationResult) -> str:
    """Return in one sentence what the verdict means."""
    if found.interrupted:
        return _CUT_SHORT
    if found.runs and found.verdict != "insufficient_data":
        return _BY_RUNS if found.verdict == "unexplained" else _ADEQUATE_BY_RUNS
    if found.verdict == "adequate" and found.unexplained.text:
        return _BUT_FOR
    return _IN_PART if found.verdict == "unexplained" and found.causes else _REASONS[found.verdict]


def further_sentences(found: ExplanationResult) -> list[str]:
    """Return what else a reader must know, a sentence each."""
    sentences = []
    if found.interrupted:
        sentences.append(
            f"The search was interrupted while {words(found.interrupted)}; the answer holds what was known then."
        )
        sentences.append(f"{_capital(found.stages)}.")
    sentences += filter(None, [residual_text(found), tolerance_hints(found)])
    sentences += [
        f"Residual of the {one.balance} balance, {one.regime}: {one.rms_over_noise_floor:.1f} times its noise floor."
        for one in found.unexplained.where[:3]
    ]
    for says in filter(None, (found.unexplained.text, found.errors.text if found.errors else "")):
        sentences.append(f"{_capital(says)}.")
    if known := [_known(one) for one in found.measured]:
        sentences.append(f"Measured at the bench, and so no candidate: {'; '.join(known)}.")
    sentences += [
        f"{one.recording} distinguishes {words(one.cause)} from {', '.join(map(words, one.isolated_from))}."
        for one in found.isolations
    ]
    sentences += [f"{_capital(words(one.cause))} in {one.recording}: {one.text}." for one in found.transfer]
    return sentences + [f"{one.conditions}: {one.text}" for one in found.confounded]


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _known(one: MeasuredParameter) -> str:
    """Return a number that was measured.

    What the model file states without it is added where that is off.
    """
    unit = "" if one.unit == "1" else f" {one.unit}"
    off = f", {one.nominal:.3g} stated within {one.tolerance:.2g}" if one.is_cause else ""
    return f"{words(one.name)} {one.value:.4g} +- {one.uncertainty:.2g}{unit}{at_shaft(one.shaft)}{off}"
