"""Check the contract of an effect.

Plant, model files and explanations can use an effect that keeps it.
"""

from __future__ import annotations

import keyword
from collections.abc import Iterable, Mapping

import numpy as np

from etb_hil.base.stock import stock_file
from etb_hil.plant.effects import compose
from etb_hil.plant.effects.effect import Effect, EffectParameter, Function, arguments
from etb_hil.plant.effects.layout import SLOW, extended
from etb_hil.plant.effects.port import (
    FRICTION_STATE_ASKS,
    QUANTITIES,
    SENSOR_ASKS,
    START_ASKS,
    STATE_ASKS,
    Port,
)
from etb_hil.plant.parameters import load_model
from etb_hil.plant.physics import Vector

_TEXTS = ("equation", "looks_like", "check", "separated_by", "source")
_TRIED = 64  # points of the quantities at which a term is tried
# Quantities of a throttle, within which a term must be finite.
_RANGES = {
    "theta": (-0.1, 1.7), "angle": (-40.0, 40.0), "plate": (-0.1, 1.7), "omega": (-40.0, 40.0), "load": (-5.0, 5.0),
    "bristle_torque": (-0.5, 0.5), "temperature": (-40.0, 140.0), "surplus": (0.0, 0.8), "current": (-20.0, 20.0),
    "command": (-16.0, 16.0), "travel": (-0.01, 0.01), "dt": (50e-6, 5e-3),
}  # fmt: skip


def misstatements(effect: Effect, others: Mapping[str, Effect]) -> list[str]:
    """Return what is wrong with a declaration, in sentences; compile nothing.

    The declaration stands beside the other effects.
    """
    if not effect.id.isidentifier() or effect.id != effect.id.lower():
        return [f"the id of an effect is a name in lower case with underscores (it is {effect.id!r})"]
    found = ["there is an effect of this id already"] if effect.id in others else []
    found += [f"`{name}` is empty" for name in _TEXTS if not str(getattr(effect, name)).strip()]
    found += _of_parameters(effect)
    found += _of_terms(effect)
    for name in (*effect.look_alikes, *effect.without_current_like):
        if name not in others and name.partition(":")[0] != "parameter":
            found.append(f"look-alikes must be effects, or parameter:NAME (got {name})")
    strengths = {effect.parameters[k].name for k in effect.strengths}
    found += [f"{name} in `by_bench` must be a strength" for name in effect.by_bench[1] if name not in strengths]
    found += [f"{law.strength} in `laws` must be a strength" for law in effect.laws if law.strength not in strengths]
    return [f"{effect.id}: {one}" for one in found]


def closed_ports(effect: Effect) -> list[str]:
    """Return, in sentences, which closed ports an effect takes.

    Only this package's own effects may have them.
    """
    found = [f"the port {port.name} is closed to effects from outside" for port in effect.terms if not port.is_open]
    found += ["a sensor's memory is closed to effects from outside"] if effect.sensor is not None else []
    return [f"{effect.id}: {one}" for one in found]


def misfits(effect: Effect) -> list[str]:
    """Return, in sentences, where an effect's functions break its contract.

    They are compiled for that.
    """
    rng = np.random.default_rng(0)
    found = []
    for port in (port for port in Port if port.is_open and effect.acts_at(port)):
        made = compose.composed(port, [effect])
        takes = compose.port_arguments(port)
        plain, strong = _vector(effect, 0.0), _vector(effect, 1.0)
        changed = False
        for _ in range(_TRIED):
            value = rng.uniform(0.5, 1.5)
            asked = [_any(name, rng, _slow(effect, rng)) for name in takes[:-1]]
            nothing, something = made(value, *asked, plain), made(value, *asked, strong)
            if nothing != value:
                found.append(f"its term at {port.name} is not zero where its strengths are zero")
                break
            if not np.isfinite(something):
                said = ", ".join(f"{n} = {x:.3g}" for n, x in zip(takes, asked, strict=False) if n != "slow")
                found.append(f"its term at {port.name} is not finite at {said or 'its first steps'}")
                break
            changed |= something != value
        else:
            if not changed:
                found.append(f"its term at {port.name} does nothing at the first steps of its strengths")
    return [f"{effect.id}: {one}" for one in found]


def _of_parameters(effect: Effect) -> Iterable[str]:
    names = [parameter.name for parameter in effect.stated]
    for parameter in effect.stated:
        yield from _of_parameter(parameter)
        if names.count(parameter.name) > 1:
            yield f"there are two parameters {parameter.name}"
        if parameter.name in compose.BASE or parameter.name in QUANTITIES:
            yield f"a parameter cannot be named {parameter.name}: the model has that name"
    if not effect.searched:
        yield "no strength has steps (`strength(...)` with at least one), so that nothing could find it"


def _of_parameter(parameter: EffectParameter) -> Iterable[str]:
    name = parameter.name
    if not name.isidentifier() or keyword.iskeyword(name):
        yield f"the name of a parameter must be a Python name (got {name!r})"
    if not parameter.low < parameter.high:
        yield f"{name} has no range ({parameter.low:g} to {parameter.high:g} {parameter.unit})"
    for value in (*parameter.starts, *parameter.elsewhere):
        if not parameter.low <= value <= parameter.high:
            allowed = f"{parameter.low:g} to {parameter.high:g} {parameter.unit}"
            yield f"{name} starts at {value:g}, outside its range of {allowed}"
    if not parameter.is_strength and not parameter.starts:
        yield f"the shape {name} has no values to begin from"
    if not parameter.source:
        yield f"{name} has no source"


def _of_terms(effect: Effect) -> Iterable[str]:
    if not effect.terms:
        yield "it has no term; `terms` holds its functions by port"
    for port in effect.terms:
        states = (state.name for state in effect.states) if port.has_states else ()
        for function in effect.at(port):
            yield from _of_function(effect, function, port.name, (*port.asks, *states))
    if effect.sensor is not None:
        yield from _of_function(effect, effect.sensor.step, "the sensor's memory", SENSOR_ASKS)
    for state in effect.states:
        asks = FRICTION_STATE_ASKS if effect.is_of_friction else STATE_ASKS
        yield from _of_function(effect, state.step, f"the state {state.name}", (*asks, state.name))
        if state.start is not None:
            yield from _of_function(effect, state.start, f"the start of {state.name}", START_ASKS)


def _of_function(effect: Effect, function: Function, where: str, asks: Iterable[str]) -> Iterable[str]:
    known = {*asks, *compose.BASE, *(parameter.name for parameter in effect.stated)}
    for name in arguments(function):
        if name not in known:
            allowed = ", ".join([*asks, *(parameter.name for parameter in effect.stated)])
            yield f"at {where} a function asks for {name}; known there: {allowed}, and the base parameters"


def _vector(effect: Effect, steps: float) -> Vector:
    """Return a whole vector with an effect at so many steps of its strengths.

    Steps and shapes are those that are tried first.
    """
    p = extended(load_model(stock_file("model", "default")).values.vector())
    for parameter, place in zip(effect.stated, effect.stated_indices, strict=True):
        if not parameter.is_strength:
            p[place] = parameter.starts[0]
        elif parameter.starts:
            p[place] = steps * parameter.starts[0]
    return p


def _slow(effect: Effect, rng: np.random.Generator) -> Vector:
    return rng.uniform(0.0, 1.0, SLOW) if effect.states else np.zeros(SLOW)


def _any(name: str, rng: np.random.Generator, slow: Vector) -> Vector | float:
    return slow if name == "slow" else rng.uniform(*_RANGES[name])
