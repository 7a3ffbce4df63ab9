"""Values as people read them.

Angles are in degrees, digits are as many as mean something, `-` is unknown.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the live panel shows values too, and starts in a tenth of the time without numpy and pydantic
    from etb_hil.results.measurement import Measurement

# SI unit -> (unit shown, factor, decimals at least); units that are not here are shown as they are, with four digits.
_SHOWN = {
    "rad": ("deg", 180.0 / math.pi, 2),
    "rad/s": ("deg/s", 180.0 / math.pi, 1),
    "N·m": ("N·m", 1.0, 3),
    "A": ("A", 1.0, 3),
    "V": ("V", 1.0, 2),
    "degC": ("°C", 1.0, 1),
    "s": ("s", 1.0, 3),
    "ohm": ("ohm", 1.0, 3),
    "V·s/rad": ("V·s/rad", 1.0, 4),
    "N·m·s/rad": ("N·m·s/rad", 1.0, 5),
    "N·m/rad": ("N·m/rad", 1.0, 4),
}
_MOST_DECIMALS = 9

UNKNOWN = "-"
UNKNOWN_WORD = "unknown"  # in sentences


def plain(value: float | None, unit: str, decimals: int | None = None) -> str:
    """Return a value in SI without its unit, as it is shown.

    `decimals` count in the unit that is shown.
    """
    if value is None or not math.isfinite(value):
        return UNKNOWN
    _, scale, usual = _SHOWN.get(unit, (unit, 1.0, None))
    places = usual if decimals is None else decimals
    if places is None:
        return f"{value:.0f}" if value >= 1e4 else f"{value:.4g}"
    return f"{round(value * scale, places) + 0.0:.{places}f}"  # + 0.0: nothing is shown as -0.000


def factor(unit: str) -> float:
    """Return the factor from a value in an SI unit to the value that is shown."""
    return _SHOWN.get(unit, (unit, 1.0))[1]


def unit_shown(unit: str) -> str:
    """Return the unit in which values of an SI unit are shown."""
    return "" if unit == "1" else _SHOWN.get(unit, (unit,))[0]


def quantity(value: float | None, unit: str, decimals: int | None = None) -> str:
    """Return a value with its unit, or `-` where there is none."""
    text = plain(value, unit, decimals)
    return text if text == UNKNOWN else f"{text} {unit_shown(unit)}".rstrip()


def decimals(one: Measurement) -> int | None:
    """Return how many decimals a measurement needs.

    Its interval and its limits stay distinct from zero.

    Half the interval shows one significant digit at least, a limit two. None: four significant digits of the value.
    """
    if one.unit not in _SHOWN:
        return None
    _, scale, usual = _SHOWN[one.unit]
    needed = [usual]
    if one.low is not None and one.high is not None:
        needed.append(_places(0.5 * (one.high - one.low) * scale, 1))
    needed += [_places(limit * scale, 2) for limit in (one.limit_low, one.limit_high) if limit is not None]
    return min(max(needed), _MOST_DECIMALS)


def _places(value: float, digits: int) -> int:
    if value == 0.0 or not math.isfinite(value):
        return 0
    return digits - 1 - math.floor(math.log10(abs(value)))


def value(one: Measurement) -> str:
    """Return the value of a measurement without its unit, `at most x` of a bound."""
    if one.is_bound:
        return f"at most {plain(one.high, one.unit, decimals(one))}"
    return plain(one.value, one.unit, decimals(one))


def measured(one: Measurement) -> str:
    """Return the value of a measurement with its unit, or `-` where there is none."""
    text = value(one)
    return text if text == UNKNOWN else f"{text} {unit_shown(one.unit)}".rstrip()


def limit(one: Measurement) -> str:
    """Return the limit of a measurement with its unit.

    The limit is the nearer one where there are two, `-` where there is none.
    """
    return quantity(nearer_limit(one), one.unit, decimals(one))


def nearer_limit(one: Measurement) -> float | None:
    """Return the limit of a measurement in SI, the one that its value is nearer to.

    None where there is none. Of a bound that keeps the upper limit, it is the lower one.
    """
    if one.limit_low is None or one.limit_high is None:
        return one.limit_low if one.limit_high is None else one.limit_high
    parting = one.limit_high if one.is_bound else 0.5 * (one.limit_low + one.limit_high)
    found = one.value_or_bound
    return one.limit_low if found is not None and found < parting else one.limit_high


def interval(one: Measurement) -> str:
    """Return the 95 % interval as `low to high`, or an empty text.

    The value of a bound says it already.
    """
    if one.low is None or one.high is None or one.is_bound:
        return ""
    return " to ".join(plain(edge, one.unit, decimals(one)) for edge in (one.low, one.high))


def limits(one: Measurement) -> str:
    """Return the limits as `at most x`, `at least x` or `x to y`, or an empty text."""
    low, high = (plain(edge, one.unit, decimals(one)) for edge in (one.limit_low, one.limit_high))
    if one.limit_low is None:
        return "" if one.limit_high is None else f"at most {high}"
    return f"at least {low}" if one.limit_high is None else f"{low} to {high}"


def in_words(one: Measurement) -> tuple[str, str, str]:
    """Return the value with its unit and interval, the limits, and the verdict.

    What there is none of is empty.
    """
    within = interval(one)
    value_shown = f"{measured(one)} ({within})" if within else measured(one)
    return value_shown, limits(one), str(one.verdict or "")


def heading(measurement_id: str, name: str) -> str:
    """Return a measurement's name as a heading, with its id where that says more."""
    said = sentence_case(name)
    return f"{said} ({measurement_id})" if says_more(measurement_id, name) else said


def sentence_case(text: str) -> str:
    """Return a text with a capital at its beginning."""
    return text[:1].upper() + text[1:]


def says_more(measurement_id: str, name: str) -> bool:
    """Return whether an id says more than the name, not the same with underscores."""
    return measurement_id.replace("_", " ").casefold() != name.replace("(", "").replace(")", "").casefold()


def sentence(one: Measurement) -> str:
    """Return what was measured and what is allowed, as a sentence.

    The sentence reads `name is 0.171 N·m (0.167 to 0.175), allowed at most 0.260`.
    """
    within = f" ({interval(one)})" if interval(one) else ""
    return f"{one.name} is {measured(one)}{within}, allowed {limits(one)}"
