"""Sentence about numbers that a record moves to the edge of their tolerances."""

from __future__ import annotations

from etb_hil.report.explain_values import joined, words
from etb_hil.results.explained.models import CalibratedParameter
from etb_hil.results.explanation import ExplanationResult


def tolerance_hints(found: ExplanationResult) -> str:
    """Return which stated numbers a record moved, and would move farther.

    Numbers of effects have no tolerance; those of the fit that are not what the model file states are said of any
    verdict. Of an unexplained record it is said which numbers its fit has at the edge of a tolerance.
    """
    hints = []
    if other := [_moved(name, one) for name, one in found.calibrated.items() if _is_moved(one)]:
        hints.append(f"The fit has {joined(other)}.")
    at_edge = [_said(name, one) for name, one in found.calibrated.items() if _is_at_edge(one)]
    if at_edge and found.verdict == "unexplained":
        hints.append(f"The fit ends at the edge of what the model file allows of {joined(at_edge)}.")
    return " ".join(hints)


def _is_moved(one: CalibratedParameter) -> bool:
    """Tell whether a number without a tolerance is certain to be another one."""
    return one.tolerance == 0.0 and one.interval is not None and not one.interval[0] <= one.nominal <= one.interval[1]


def _moved(name: str, one: CalibratedParameter) -> str:
    unit = "" if one.unit == "1" else f" {one.unit}"
    return f"{words(name)} at {one.value:.3g}{unit} (stated {one.nominal:.3g})"


def _is_at_edge(one: CalibratedParameter) -> bool:
    return one.tolerance > 0.0 and abs(one.value - one.nominal) >= one.tolerance


def _said(name: str, one: CalibratedParameter) -> str:
    unit = "" if one.unit == "1" else f" {one.unit}"
    return f"{words(name)} ({one.value:.3g}{unit}, stated {one.nominal:.3g} within {one.tolerance:.2g})"
