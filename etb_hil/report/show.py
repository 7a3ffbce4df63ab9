"""Values as people read them: degrees instead of radians, no more digits than mean something, `-` for unknown."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the live panel shows values too, and starts in a tenth of the time without numpy and pydantic
    from etb_hil.report.model import Number, Phase

# SI unit -> (unit shown, factor, decimals); units that are not here are shown as they are, with four digits.
_SHOWN = {
    "rad": ("deg", 180.0 / math.pi, 2),
    "rad/s": ("rad/s", 1.0, 2),
    "N·m": ("N·m", 1.0, 3),
    "A": ("A", 1.0, 3),
    "V": ("V", 1.0, 2),
    "degC": ("°C", 1.0, 1),
    "s": ("s", 1.0, 3),
    "ohm": ("ohm", 1.0, 3),
    "V·s/rad": ("V·s/rad", 1.0, 4),
    "N·m·s/rad": ("N·m·s/rad", 1.0, 5),
}

UNKNOWN = "-"
UNKNOWN_WORD = "unknown"  # in sentences


def plain(value: float | None, unit: str) -> str:
    """Return the value without its unit, as it is shown."""
    if value is None or not math.isfinite(value):
        return UNKNOWN
    _, factor, decimals = _SHOWN.get(unit, (unit, 1.0, -1))
    if decimals < 0:
        return f"{value:.0f}" if value >= 1e4 else f"{value:.4g}"
    return f"{round(value * factor, decimals) + 0.0:.{decimals}f}"  # + 0.0: nothing is shown as -0.000


def unit_shown(unit: str) -> str:
    """Return the unit in which values of an SI unit are shown."""
    return "" if unit == "1" else _SHOWN.get(unit, (unit,))[0]


def quantity(value: float | None, unit: str) -> str:
    """Return the value with its unit, or `-` where there is none."""
    text = plain(value, unit)
    return text if text == UNKNOWN else f"{text} {unit_shown(unit)}".rstrip()


def interval(number: Number) -> str:
    """Return the 95 % interval as `low to high`, or an empty text."""
    if number.low is None or number.high is None:
        return ""
    return f"{plain(number.low, number.unit)} to {plain(number.high, number.unit)}"


def limits(number: Number) -> str:
    """Return the limits as `at most x`, `at least x` or `x to y`, or an empty text."""
    low, high = plain(number.limit_low, number.unit), plain(number.limit_high, number.unit)
    if number.limit_low is None:
        return "" if number.limit_high is None else f"at most {high}"
    return f"at least {low}" if number.limit_high is None else f"{low} to {high}"


def share(value: float | None) -> str:
    """Return a share of 1 in per cent."""
    return UNKNOWN if value is None or not math.isfinite(value) else f"{100.0 * value:.1f} %"


def printable(text: str, longest: int = 200) -> str:
    """Return a text without control characters, cut to a length: no name can steer a terminal or flood a page."""
    clean = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)
    return clean if len(clean) <= longest else clean[: longest - 3] + "..."


def phase_name(phase: Phase) -> str:
    """Return the name of a phase as its scenario's author knows it."""
    return (phase.id or phase.name).replace("_", " ")
