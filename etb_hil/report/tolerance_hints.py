"""Sentence about numbers that a record moves to the edge of their tolerances."""

from __future__ import annotations

from etb_hil.report.explain_values import joined, words
from etb_hil.results.explained.models import CalibratedParameter
from etb_hil.results.explanation import ExplanationResult


def tolerance_hints(found: ExplanationResult) -> str:
    """Return which numbers an unexplained record would move farther.

    The text is empty unless an answer is `unexplained` and a fit ended at the edge of a tolerance.
    """
    if found.verdict != "unexplained":
        return ""
    at_edge = [_said(name, one) for name, one in found.calibrated.items() if _is_at_edge(one)]
    return f"The fit ends at the edge of what the model file allows of {joined(at_edge)}." if at_edge else ""


def _is_at_edge(one: CalibratedParameter) -> bool:
    return one.tolerance > 0.0 and abs(one.value - one.nominal) >= one.tolerance


def _said(name: str, one: CalibratedParameter) -> str:
    unit = "" if one.unit == "1" else f" {one.unit}"
    return f"{words(name)} ({one.value:.3g}{unit}, stated {one.nominal:.3g} within {one.tolerance:.2g})"
