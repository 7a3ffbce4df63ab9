"""The `effects` list of a model file, to and from the extended vector.

An entry has ids and strengths.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from etb_hil.base.errors import Problem
from etb_hil.base.nearest import did_you_mean
from etb_hil.base.quantity import dimension_of_unit, tidy_unit, to_si
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.effect import Effect, EffectParameter
from etb_hil.plant.effects.layout import PLATE_INERTIA, extended
from etb_hil.plant.measured import Measured
from etb_hil.plant.physics import Vector


def problem_of(id_: str, strengths: Mapping[str, str | float]) -> tuple[tuple[str, ...], Problem] | None:
    """Return the key in an entry that is wrong, and what is wrong; None if none is."""
    effect = CATALOGUE.get(id_)
    if effect is None:
        meant = did_you_mean(id_, CATALOGUE)
        return ("id",), Problem("unknown effect", value=id_, allowed=", ".join(CATALOGUE), remedy=meant)
    names = [parameter.name for parameter in effect.stated]
    for name, value in strengths.items():
        key = ("strengths", name)
        if name not in names:
            meant = did_you_mean(name, names)
            return key, Problem(f"{id_} has no such parameter", value=name, allowed=", ".join(names), remedy=meant)
        parameter = effect.stated[names.index(name)]
        try:
            number = parsed(value, parameter)
        except ValueError as error:
            return key, Problem(f"{id_}: {name}: {error}", value=value)
        if not parameter.low <= number <= parameter.high:
            allowed = f"{parameter.low:g} to {parameter.high:g} {parameter.unit}"
            return key, Problem(f"{id_}: {name} is out of its range", value=value, allowed=allowed)
    return None


def parsed(value: str | float, parameter: EffectParameter) -> float:
    """Return a strength or shape in its own unit.

    ValueError where it is written in another.
    """
    if isinstance(value, int | float) and not isinstance(value, bool):
        if parameter.unit != "1":
            raise ValueError(f"a value with its unit is expected, for instance '1 {parameter.unit}'")
        return float(value)
    number, _, unit = str(value).strip().partition(" ")
    if tidy_unit(unit or "1") == tidy_unit(parameter.unit):
        return float(number)
    dimension = dimension_of_unit(parameter.unit)
    if dimension is None or dimension_of_unit(unit) != dimension:
        raise ValueError(f"its unit is {parameter.unit}")
    own = to_si(1.0, parameter.unit, dimension)
    return to_si(float(number), unit, dimension) / own


def measured_strength(name: str, value: str | float, uncertainty: str | float) -> Measured:
    """Return what was measured of an effect's strength, `<effect>.<strength>`.

    ValueError says what is wrong.
    """
    effect = CATALOGUE.get(name.partition(".")[0])
    known = {} if effect is None else {f"{effect.id}.{p.name}": p for p in effect.stated if p.is_strength}
    if name not in known:
        allowed = ", ".join(known) or "a parameter's name, or <effect>.<strength>"
        raise ValueError(f"'{name}' is nothing that could be measured; allowed: {allowed}")
    parameter = known[name]
    number = parsed(value, parameter)
    try:
        width = parsed(uncertainty, parameter)
    except ValueError as error:
        raise ValueError(f"uncertainty: {error} (it is {uncertainty!r})") from error
    if not parameter.low <= number <= parameter.high:
        raise ValueError(f"{name} is {parameter.low:g} to {parameter.high:g} {parameter.unit}")
    if width <= 0.0:
        raise ValueError("an uncertainty is above 0")
    return Measured(name, number, width, parameter.unit, 0.0, 0.0)


def written(number: float, parameter: EffectParameter) -> str | float:
    """Return a strength or shape as a model file has it."""
    return float(f"{number:.6g}") if parameter.unit == "1" else f"{number:.6g} {parameter.unit}"


def whole_vector(
    base: Vector, plate_inertia: float, effects: Iterable[tuple[str, Mapping[str, str | float]]]
) -> Vector:
    """Return base parameters with effects behind them.

    Shapes that are not given take the middle of their grid.
    """
    p = extended(base)
    p[PLATE_INERTIA] = plate_inertia
    for id_, strengths in effects:
        effect = CATALOGUE[id_]
        for parameter, place in zip(effect.stated, effect.stated_indices, strict=True):
            if parameter.name in strengths:
                p[place] = parsed(strengths[parameter.name], parameter)
            elif not parameter.is_strength:
                p[place] = parameter.starts[len(parameter.starts) // 2]
    return p


def entry_of(effect: Effect, p: Vector) -> dict[str, str | float]:
    """Return an effect's strengths and shapes in a vector, as for a model file."""
    return {
        parameter.name: written(float(p[place]), parameter)
        for parameter, place in zip(effect.stated, effect.stated_indices, strict=True)
        if not parameter.under or p[effect.place(parameter.under)] != 0.0
    }
