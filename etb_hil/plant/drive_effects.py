"""Effects in a drive's model file; a linear one has N for N·m, m for rad."""

from __future__ import annotations

from collections.abc import Iterable

from etb_hil.base.errors import Problem
from etb_hil.base.nearest import did_you_mean
from etb_hil.base.quantity import tidy_unit
from etb_hil.plant.effects.catalogue import CATALOGUE, OWN
from etb_hil.plant.effects.effect import Effect, EffectParameter, Need
from etb_hil.plant.model_file import EffectEntry

THROTTLE_FRICTION = 0.144  # N·m of the throttle that the catalogue's bounds are for
_LARGEST = 1e6  # N or N·m: a drive of any size has less
_LINEAR = {"N·m": "N", "rad": "m", "rad/s": "m/s"}


Wrong = tuple[tuple[str, ...], Problem]  # the key in an entry that is wrong, and what is wrong


def gravity() -> Effect:
    """Return the effect of a mass that gravity turns: a part of a drive's file."""
    return next(effect for effect in OWN if Need.PENDULUM in effect.needs)


def read_effects(entries: Iterable[EffectEntry], *, is_linear: bool) -> list[EffectEntry | Wrong]:
    """Return effects as a throttle's model has them, or what is wrong."""
    return [_read(entry, is_linear) for entry in entries]


def _read(entry: EffectEntry, is_linear: bool) -> EffectEntry | Wrong:
    effect = CATALOGUE.get(entry.id)
    if effect is None:
        meant = did_you_mean(entry.id, CATALOGUE)
        return ("id",), Problem("unknown effect", value=entry.id, allowed=", ".join(CATALOGUE), remedy=meant)
    known = {parameter.name: parameter for parameter in effect.stated}
    found: dict[str, str | float] = {}
    for name, value in entry.strengths.items():
        key = ("strengths", name)
        if name not in known:
            meant = did_you_mean(name, known)
            return key, Problem(f"{entry.id} has no such parameter", value=name, allowed=", ".join(known), remedy=meant)
        parameter = known[name]
        unit = unit_for(parameter, is_linear=is_linear)
        number, _, its = str(value).partition(" ")
        low, high = (-_LARGEST, _LARGEST) if parameter.unit == "N·m" else (parameter.low, parameter.high)
        try:
            if tidy_unit(its or "1") != tidy_unit(unit):
                raise ValueError(its)  # noqa: TRY301 (as a number that is none)
            amount = float(number)
        except ValueError:
            return key, Problem(f"{entry.id}: {name} must be a number with its unit", value=value, allowed=unit)
        if not low <= amount <= high:
            allowed = f"{low:g} to {high:g} {unit}"
            return key, Problem(f"{entry.id}: {name} is out of its range", value=value, allowed=allowed)
        found[name] = amount if parameter.unit == "1" else f"{number} {parameter.unit}"
    return EffectEntry(id=entry.id, strengths=found)


def written_effects(entries: Iterable[EffectEntry], *, is_linear: bool) -> list[dict[str, object]]:
    """Return the `effects` of a drive's file from those that its model has."""
    found: list[dict[str, object]] = []
    for entry in entries:
        known = {parameter.name: parameter for parameter in CATALOGUE[entry.id].stated}
        strengths = {
            name: value
            if known[name].unit == "1"
            else f"{str(value).split()[0]} {unit_for(known[name], is_linear=is_linear)}"
            for name, value in entry.strengths.items()
        }
        found.append({"id": entry.id, "strengths": strengths})
    return found


def unit_for(parameter: EffectParameter, *, is_linear: bool) -> str:
    """Return the unit of an effect's parameter.

    A linear drive's is that of forces and lengths.
    """
    return _LINEAR.get(parameter.unit, parameter.unit) if is_linear else parameter.unit
