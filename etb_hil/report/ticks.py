"""Ticks of a scale: their positions and labels."""

from __future__ import annotations

import math

_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
_FINER = (5.0, 2.5, 2.0, 1.0, 0.5, 0.25, 0.2, 0.1)
_MOST = 9  # intervals of a scale
_ALMOST = 1e-9  # of a step: rounding
_RESOLVED = 1e-12  # of the larger end: finer steps are not distinguished by float64, nor by their texts
_LARGE = 1e300
_LEAST = 1e-300  # of a step: below, float64 loses digits
_PLAIN = (-5, 6)  # powers of ten between which numbers are written out
MINUS = "\u2212"


def linear(low: float, high: float, most: int) -> list[tuple[float, str]]:
    """Return round values from `low` to `high`, each with its text.

    They make at most `most` intervals, but two at least. `low` and `high` are finite. Where float64 has no round values
    between them, the ends are returned: one value where both are equal.
    """
    if max(abs(low), abs(high)) > _LARGE:  # the difference may be beyond float64, and so may be the next round value
        scaled = [value * _LARGE for value, _ in linear(low / _LARGE, high / _LARGE, most)]
        inside = [min(max(value, low), high) for value in scaled]
        return [(value, _short(value)) for value in inside]
    rough = (high - low) / max(1, min(most, _MOST))
    if not rough > max(_RESOLVED * max(abs(low), abs(high)), _LEAST):
        return [(value, _short(value)) for value in dict.fromkeys((low, high))]
    power = 10.0 ** math.floor(math.log10(rough))
    fitting = [power * each for each in _STEPS if power * each >= rough * (1.0 - _ALMOST)][:1]
    for step in (*fitting, *(power * each for each in _FINER if power * each < fitting[0])):
        first, last = math.ceil(low / step - _ALMOST), math.floor(high / step + _ALMOST)
        if last > first:
            break
    values = [k * step for k in range(first, last + 1)]
    is_plain = _PLAIN[0] < math.log10(step) and math.log10(max(abs(low), abs(high))) < _PLAIN[1]
    if not is_plain:
        return [(value, _short(value)) for value in values]
    digits = max(0, -math.floor(math.log10(step) + _ALMOST))
    digits += not math.isclose(step * 10.0**digits, round(step * 10.0**digits))
    return [(value, text(value, digits)) for value in values]


def logarithmic(low: float, high: float) -> list[tuple[float, str]]:
    """Return 1, 2 and 5 of each power of ten in a range, each with its text.

    The range is from `low` to `high`.
    """
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    values = [digit * 10.0**power for power in powers for digit in (1.0, 2.0, 5.0)]
    return [(value, _short(value)) for value in values if low <= value <= high]


def text(value: float, digits: int) -> str:
    """Return a number with `digits` decimals, and with a true minus."""
    written = f"{value + 0.0:.{digits}f}"
    return MINUS + written[1:] if written.startswith("-") else written


def _short(value: float) -> str:
    return f"{value:g}".replace("-", MINUS)
