"""Friction, diagnosis, data and detection limits on the page of an explanation."""

from __future__ import annotations

from typing import Any

from etb_hil.diagnosis.measurement_registry import name_of
from etb_hil.report.explain_values import scale, words
from etb_hil.results.explained.models import JudgedMeasurement
from etb_hil.results.explained.residual import DataQuality
from etb_hil.results.explanation import ExplanationResult


def friction_rows(found: ExplanationResult) -> list[dict[str, Any]]:
    """Return break-away and sliding friction in each model."""
    models = ("reference", "calibrated", "extended") if found.causes else ("reference", "calibrated")
    return [
        {"name": words(name), "numbers": [f"{getattr(p, key):.4g} {p.unit}" for key in models]}
        for name, p in found.friction.items()
    ]


def judged_sentences(found: ExplanationResult) -> list[str]:
    """Return what the diagnosis makes of these data under both models."""
    diagnosis = found.diagnosis
    if diagnosis is None:
        return []
    sentences = []
    extended = "extended model" if found.causes else "calibrated model"
    for one, model in ((diagnosis.reference, "reference model"), (diagnosis.extended, extended)):
        if one is None:
            continue
        numbers = [_with_interval(id_, number) for id_, number in one.measurements.items()]
        sentences.append(f"Diagnosis with the {model}: {', '.join(numbers) or 'no friction found'}; {one.verdict}.")
    return [*sentences, f"{diagnosis.text.capitalize()}."]


def _with_interval(name: str, number: JudgedMeasurement) -> str:
    low, high = number.interval
    if number.value is None:
        return f"{name_of(name)} at most {high:.3g} {number.unit}"
    said = f"{name_of(name)} {number.value:.3g} {number.unit}"
    return said if low is None or high is None else f"{said} (95 %: {low:.3g} to {high:.3g})"


def quality_row(one: DataQuality | str) -> dict[str, Any]:
    """Return a segment of data with the remarks on it."""
    if isinstance(one, str):
        return {"what": one, "flags": []}
    return {
        "what": f"{one.origin}: {one.duration_s:.1f} s at {one.rate_hz:.0f} Hz",
        "flags": one.flags,
    }


def detection_rows(found: ExplanationResult) -> list[dict[str, str]]:
    """Return the smallest strength of each effect that these data detect."""
    rows = []
    for name, one in sorted(found.detection_limits.items()):
        if one.limit is not None:
            times, unit = scale((), one.unit)
            limit = f"{times * one.limit:.2g} {unit}".removesuffix(" 1")
            rows.append({"name": words(name), "limit": limit, "parameter": words(one.parameter)})
    return rows


def detection_text(found: ExplanationResult) -> str:
    """Return in which range detection limits hold, and which effects have none."""
    limits = dict(sorted(found.detection_limits.items()))
    seen = any(one.limit is not None for one in limits.values())
    unseen = ", ".join(words(name) for name, one in limits.items() if one.judged and not one.within_bounds)
    others = ", ".join(f"{words(name)} ({one.text})" for name, one in limits.items() if not one.judged)
    sentences = []
    of_place = [name for name, one in limits.items() if one.valid_range]
    if of_place:
        its = ", ".join(map(words, of_place))
        sentences.append(f"These hold only in the range of this motion, {limits[of_place[0]].valid_range}: {its}.")
    sentences.append(f"These data cannot detect: {unseen}." if unseen else "")
    sentences.append(f"Not judged: {others}." if others else "")
    if seen and found.verdict == "unexplained":
        sentences.append("A listed effect may be a part of the unexplained residual.")
    return " ".join(filter(None, sentences))
