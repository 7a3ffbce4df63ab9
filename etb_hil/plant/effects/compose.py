"""Make the functions of a port from the terms of effects.

The calls are written out as source, and compiled as one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields
from typing import Any

from numba import njit
from numba.core.dispatcher import Dispatcher

from etb_hil.plant.effects.effect import Effect, Function, arguments
from etb_hil.plant.effects.layout import first_state, row
from etb_hil.plant.effects.outside import FRICTION_STEPS, STARTS, STEPS, is_there, outside
from etb_hil.plant.effects.port import FRICTION_STATE_ASKS, START_ASKS, STATE_ASKS, Combine, Port
from etb_hil.plant.values import ThrottleParameters

BASE = {field.name: place for place, field in enumerate(fields(ThrottleParameters))}

Made = Callable[..., Any]
Begins = Mapping[tuple[str, Port], int]  # where the memory of an effect's sensor begins, at a port


def port_arguments(port: Port) -> tuple[str, ...]:
    """Return the arguments of a port's function behind the value that it begins with."""
    asks = tuple(name for name in port.asks if not (port.combine is Combine.CHAIN and name == port.asks[0]))
    return (*asks, *(("slow",) if port.has_states else ()), "p")


def composed(port: Port, effects: Iterable[Effect], *, is_open: bool = False) -> Made:
    """Return a compiled function that takes in all terms at a port.

    The function is (value, quantities, states, parameters) -> value.

    Beside the first value and `p`, the extended vector, it takes the port's quantities and, where its terms may have
    states, `slow`. An exclusive term takes the value's place where any strength is not zero. `is_open`: it takes in
    the terms of effects from outside, too, whichever there are when it runs.
    """
    scope: dict[str, Any] = {"outside": outside}
    lines = []
    for effect in effects:
        for k, function in enumerate(effect.at(port)):
            name = f"{effect.id}_{k}"
            scope[name] = compiled(function)
            own = {port.asks[0]: "value"} if port.combine is Combine.CHAIN else {}
            term = f"{name}({_passed(effect, function, port.asks, own)})"
            if port.combine is Combine.EXCLUSIVE:
                lines.append(f"if {_is_there(effect)}: value = {term}")
            else:
                lines.append({"SUM": "value += {}", "PRODUCT": "value *= 1.0 + {}"}.get(port.combine.name, "value = {}")
                             .format(term))  # fmt: skip
    takes = ("value", *port_arguments(port))
    if is_open:
        lines.append(_outside(port.index, takes))
    return _made(port.name.lower(), takes, [*lines, "return value"], scope)


def steps(effects: Iterable[Effect], *, of_friction: bool, is_open: bool = False) -> Made:
    """Return a compiled function that moves the slow states in place.

    `of_friction` are those that friction has.
    """
    scope: dict[str, Any] = {"outside": outside}
    asks = FRICTION_STATE_ASKS if of_friction else STATE_ASKS
    lines = []
    for effect in effects:
        if of_friction and not effect.is_of_friction:
            continue
        for k, state in enumerate(effect.states):
            name = f"{effect.id}_{k}"
            scope[name] = compiled(state.step)
            lines.append(f"slow[{first_state(effect.id) + k}] = {name}({_passed(effect, state.step, asks)})")
    takes = ("value", *asks, "slow", "p")
    if is_open:
        lines.append(_outside(FRICTION_STEPS if of_friction else STEPS, takes))
    return _made("steps", takes, [*lines, "return value"], scope)


def starts(effects: Iterable[Effect], *, is_open: bool = False) -> Made:
    """Return a compiled function that sets the slow states in place.

    They are those of a device that has long been at a temperature.
    """
    scope: dict[str, Any] = {"outside": outside}
    lines = []
    for effect in effects:
        for k, state in enumerate(effect.states):
            if state.start is not None:
                name = f"{effect.id}_{k}"
                scope[name] = compiled(state.start)
                passed = _passed(effect, state.start, START_ASKS)
                lines.append(f"slow[{first_state(effect.id) + k}] = {name}({passed})")
    takes = ("value", *START_ASKS, "slow", "p")
    if is_open:
        lines.append(_outside(STARTS, takes))
    return _made("starts", takes, [*lines, "return value"], scope)


def sensor_steps(effects: Iterable[Effect], port: Port, begins: Begins) -> Made:
    """Return a compiled function that moves the memory of sensors by 50 us.

    The sensors are those at a port.
    """
    scope: dict[str, Any] = {}
    lines = []
    for effect in effects:
        if effect.sensor is not None and effect.acts_at(port):
            scope[effect.id] = compiled(effect.sensor.step)
            own = {"memory": _memory(effect, port, begins)}
            call = f"{effect.id}({_passed(effect, effect.sensor.step, ('travel', 'current'), own)})"
            lines.append(f"if {_is_there(effect)}: {call}")
    return _made("sensor_steps", ("memory", "travel", "current", "p"), [*lines, "return"], scope)


def sensed(effects: Iterable[Effect], port: Port, begins: Begins) -> Made:
    """Return a compiled function that reads a sensor with memory.

    The function is (value, memory, parameters) -> reading.
    """
    scope: dict[str, Any] = {}
    lines = []
    for effect in effects:
        for function in effect.at(port):
            scope[effect.id] = compiled(function)
            own = {port.asks[0]: "value", "memory": _memory(effect, port, begins)}
            lines.append(f"if {_is_there(effect)}: value = {effect.id}({_passed(effect, function, (), own)})")
    return _made("sensed", ("value", "memory", "p"), [*lines, "return value"], scope)


def outside_at(*indices: int) -> Made:
    """Return a function that tells whether effects from outside are in the table.

    The function is () -> bool, and looks at some places.
    """
    asked = " or ".join(f"is_there({index})" for index in indices)
    return _made("outside_at", (), [f"return {asked}"], {"is_there": is_there})


def compiled(function: Function) -> Made:
    """Return a function of an effect compiled, as it is where it already was."""
    return function if isinstance(function, Dispatcher) else njit(error_model="numpy", forceinline=True)(function)


def called(effect: Effect, function: Function, p: Any, **quantities: Any) -> Any:
    """Call a function of an effect without compiling it.

    Quantities may be whole records (n).
    """
    numbers = {parameter.name: row(effect.id) + k for k, parameter in enumerate(effect.stated)}
    asked = arguments(function)
    own = {name: p[{**BASE, **numbers}[name]] for name in asked if name not in quantities}
    return function(**own, **{name: one for name, one in quantities.items() if name in asked})


def _passed(effect: Effect, function: Function, asks: Iterable[str], own: Mapping[str, str] | None = None) -> str:
    """Return what a call of a function passes, by the names of its arguments."""
    known = {name: f"p[{place}]" for name, place in BASE.items()}
    known |= {state.name: f"slow[{first_state(effect.id) + k}]" for k, state in enumerate(effect.states)}
    known |= {parameter.name: f"p[{row(effect.id) + k}]" for k, parameter in enumerate(effect.stated)}
    known |= {name: name for name in asks} | dict(own or {})
    return ", ".join(known[name] for name in arguments(function))


def _memory(effect: Effect, port: Port, begins: Begins) -> str:
    assert effect.sensor is not None  # noqa: S101 (asked of sensors with a memory alone)
    first = begins[effect.id, port]
    return f"memory[{first}:{first + effect.sensor.size}]"


def _is_there(effect: Effect) -> str:
    return " or ".join(f"p[{place}] != 0.0" for place in effect.acting_indices)


def _outside(index: int, takes: tuple[str, ...]) -> str:
    """Return the line that hands a value to the effects from outside."""
    quantities = "".join(f"{name}, " for name in takes if name not in {"value", "slow", "p"})
    slow = "slow" if "slow" in takes else "p"
    return f"value = outside({index}, value, ({quantities}), {slow}, p)"


def _made(name: str, takes: Iterable[str], lines: Iterable[str], scope: dict[str, Any]) -> Made:
    body = "\n    ".join(lines)
    exec(f"def {name}({', '.join(takes)}):\n    {body}\n", scope)  # noqa: S102 (written here, from checked names)
    return njit(error_model="numpy", forceinline=True)(scope[name])
