"""All effects, by id: those of this package's modules, and those of plug-ins."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.plugins import Part, first_line, foreign_code, parts, when_changed
from etb_hil.plant.effects import compose, outside
from etb_hil.plant.effects.contract import closed_ports, misfits, misstatements
from etb_hil.plant.effects.effect import Balance, Effect, EffectParameter, Parity
from etb_hil.plant.effects.layout import give_room, is_full, take_room
from etb_hil.plant.effects.port import FRICTION_STATE_ASKS, START_ASKS, STATE_ASKS, Port

# What serves the effects and is none; every other module of the package is an effect.
_SERVING = {
    "__init__", "catalogue", "compose", "contract", "curves", "effect", "entries", "laws", "layout", "outside", "port",
    "backlash_contact", "late_reading", "ports", "readings", "sensing",
}  # fmt: skip


def _own() -> dict[str, Effect]:
    """Return the effects of the package's modules, in the order of their names."""
    found = {}
    for name in sorted(path.stem for path in Path(__file__).parent.glob("*.py") if path.stem not in _SERVING):
        effect = importlib.import_module(f"{__package__}.{name}").EFFECT
        give_room(effect.id, len(effect.stated), len(effect.states))
        found[effect.id] = effect
    return found


_effects = _own()
OWN = tuple(_effects.values())  # what the compiled kernels hold
CATALOGUE: Mapping[str, Effect] = MappingProxyType(_effects)


@cache
def acting_at(*ports: Port) -> tuple[Effect, ...]:
    """Return the effects that have a term at one of some ports."""
    return tuple(effect for effect in _effects.values() if effect.acts_at(*ports))


@cache
def strengths_at(*ports: Port) -> NDArray[np.int64]:
    """Return the indices of the strengths of the effects at some ports.

    They are those in the extended vector.
    """
    return np.array([place for one in acting_at(*ports) for place in one.acting_indices], np.int64)


@cache
def places_at(*ports: Port) -> NDArray[np.int64]:
    """Return the indices of all parameters of the effects at some ports.

    They are those in the extended vector.
    """
    return np.array([place for one in acting_at(*ports) for place in one.stated_indices], np.int64)


def register(effect: Effect, place: Place | None = None) -> None:
    """Take in an effect from outside.

    The plant has it, model files may name it, explanations look for it.

    Raises InputError that lists what breaks its contract; nothing of it is taken in then.
    """
    problems = [*misstatements(effect, _effects), *closed_ports(effect)]
    if not problems and is_full(len(effect.stated), len(effect.states)):
        problems = [f"{effect.id}: there is no room for so many parameters and states beside the other effects"]
    if problems:
        raise InputError(*(Problem(one, place) for one in problems))
    give_room(effect.id, len(effect.stated), len(effect.states))

    def refused(error: BaseException) -> InputError:
        return InputError(Problem(f"{effect.id}: its functions cannot be compiled: {first_line(error)}", place))

    try:
        with foreign_code(refused):
            functions = _callbacks([*_from_outside(), effect])
            problems = misfits(effect)
    except BaseException:
        take_room(effect.id)
        raise
    if problems:
        take_room(effect.id)
        raise InputError(*(Problem(one, place) for one in problems))
    _effects[effect.id] = effect
    outside.put_in(functions)
    _forget()


def unregister(id_: str) -> None:
    """Take out an effect that came from outside.

    InputError where there is none of this id.
    """
    left = [one for one in _from_outside() if one.id != id_]
    if len(left) == len(_from_outside()):
        allowed = ", ".join(one.id for one in left) or "none was taken in"
        raise InputError(Problem("no effect from outside has this id", value=id_, allowed=allowed))
    outside.put_in(_callbacks(left))
    del _effects[id_]
    take_room(id_)
    _forget()


def _forget() -> None:
    for asked in (acting_at, strengths_at, places_at):
        asked.cache_clear()


def _from_outside() -> list[Effect]:
    return [one for one in _effects.values() if one not in OWN]


def _callbacks(effects: list[Effect]) -> dict[int, object]:
    """Return what stands in the table for some effects from outside, by index."""
    found: dict[int, object] = {}
    for port in Port:
        if port.is_open and any(one.acts_at(port) for one in effects):
            made, takes = compose.composed(port, effects), compose.port_arguments(port)
            count = len(takes) - 1 - port.has_states
            found[port.index] = outside.callback(made, count, has_states=port.has_states)
    if any(one.states for one in effects):
        made = compose.starts(effects)
        found[outside.STARTS] = outside.callback(made, len(START_ASKS), has_states=True)
        made = compose.steps(effects, of_friction=False)
        found[outside.STEPS] = outside.callback(made, len(STATE_ASKS), has_states=True)
        made = compose.steps(effects, of_friction=True)
        found[outside.FRICTION_STEPS] = outside.callback(made, len(FRICTION_STATE_ASKS), has_states=True)
    return found


def _take_plugins() -> None:
    """Have exactly the effects of today's plug-ins and those of `register`."""
    wanted = {}
    for part in parts("effects"):
        check_effect_part(part)
        wanted[part.value.id] = part
    for id_ in _of_plugins - wanted.keys():
        _of_plugins.remove(id_)
        unregister(id_)
    for id_, part in wanted.items():
        if id_ not in _of_plugins:
            with part.guarded("taking it in"):
                register(part.value, part.place)
            _of_plugins.add(id_)


def check_effect_part(part: Part) -> None:
    """Raise InputError where a field of an effect's declaration has another type."""
    part.require(Effect)
    effect: Effect = part.value
    part.require_text("id", effect.id)
    part.require_texts("equation", "looks_like", "check", "separated_by", "source")
    part.require_names("look_alikes", "without_current_like")
    for name, kind in (("balance", Balance), ("parity", Parity), ("parameters", tuple), ("terms", Mapping)):
        if not isinstance(value := getattr(effect, name), kind):
            raise part.refused(f"`{name}` must be of the type {kind.__name__} (it is {value!r})")
    for parameter in effect.parameters:
        if not isinstance(parameter, EffectParameter):
            raise part.refused(f"`parameters` must hold EffectParameter alone (one is {parameter!r})")
    for port in effect.terms:
        if not isinstance(port, Port):
            raise part.refused(f"the keys of `terms` must be of the type Port (one is {port!r})")


_of_plugins: set[str] = set()
_take_plugins()
when_changed(_take_plugins)
