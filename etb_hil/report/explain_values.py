"""Ids, values and units as the page of an explanation shows them."""

from __future__ import annotations

import math
from collections.abc import Iterable

from etb_hil.plant.names import display_name

_PARAMETER = "parameter:"
_SMALL = 0.01  # m: where all numbers of a line are smaller, they are in millimetres


def digits(half: float, value: float) -> int:
    """Return the significant digits of a value that is known to `half`.

    Two of the unsure ones are among them.
    """
    if not half > 0.0 or value == 0.0:
        return 3
    return min(max(2 + math.floor(math.log10(abs(value))) - math.floor(math.log10(half)), 2), 6)


def words(id_: str) -> str:
    """Return the name of an effect, a parameter, a parametric fault or a role."""
    fault = "parametric fault of " if id_.startswith(_PARAMETER) else ""
    effect, dot, parameter = id_.removeprefix(_PARAMETER).partition(".")
    return f"{fault}{display_name(effect)}{f' ({display_name(parameter)})' if dot else ''}"


def joined(names: Iterable[str], last: str = "and") -> str:
    """Return names as a list in a sentence, as in `a, b and c`."""
    *first, end = names
    return f"{', '.join(first)} {last} {end}" if first else end


def scale(values: Iterable[float], unit: str) -> tuple[float, str]:
    """Return the factor of numbers that stand together, and their unit with it."""
    if unit == "rad" or unit.startswith("rad/"):
        return math.degrees(1.0), unit.replace("rad", "deg", 1)
    return (1e3, "mm") if unit == "m" and max(values, default=1.0) < _SMALL else (1.0, unit)


def with_unit(value: float, unit: str) -> str:
    """Return a value with its unit, angles in degrees."""
    times, unit = scale((), unit)
    return f"{times * value:.4g}" if unit == "1" else f"{times * value:.4g} {unit}"


def at_shaft(shaft: str | None) -> str:
    """Return the shaft at which a rotary number holds.

    A gauge reads at the plate what a motor's data sheet has at the motor.
    """
    return f" at the {'plate' if shaft == 'throttle' else 'motor'} (shaft: {shaft})" if shaft else ""
