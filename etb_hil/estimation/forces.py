"""What effects add to the base equations along a motion, compiled.

One effect is taken at a time.

An effect declares its terms by port; here they are gathered into the few ways in which anything can act on a throttle.
The derivatives by angle and velocity that a filter needs are differences of these functions.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.plant.effects import compose
from etb_hil.plant.effects.catalogue import OWN
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.effects.layout import SLOW
from etb_hil.plant.effects.port import READINGS, Port
from etb_hil.plant.exactmath import gauss
from etb_hil.plant.physics import (
    BACK_EMF,
    COULOMB,
    GEAR_RATIO,
    INDUCTANCE,
    RESISTANCE,
    STICTION,
    STRIBECK_VELOCITY,
    TORQUE_PER_AMPERE,
    VISCOUS,
    Vector,
    spring_torque,
    stop_torque,
)

# What an effect adds: braking torque (N·m), share of the friction level, lost voltage (V), and to the readings of the
# current (A), the motor's angle and the plate's (rad at the throttle shaft).
BRAKING, LEVEL, LOST, AT_CURRENT, AT_MOTOR, AT_PLATE = range(6)
ADDED = 6
MEMORY = SLOW + max((one.sensor.size for one in OWN if one.sensor and one.acts_at(Port.PLATE_READING)), default=0)
INDEX = {effect.id: k for k, effect in enumerate(OWN)}
# Whether each effect acts on a reading.
READS = np.array([effect.acts_at(*READINGS, Port.PLATE_LEAD) for effect in OWN], np.bool_)

_ASKS = "theta, omega, current, command, bristle, temperature, remembered, p, out"
_PASSED = "omega, travel, current, command, temperature, dt, remembered, p"
_MOTION = "begin, end, dt, voltage, temperature, states, ahead, remembered, p, room, out"
_FINE = {
    Port.SPRINGS: "out[0] += {f}(springs, theta, p) - springs",
    Port.SPRING_TORQUE: "out[0] += {f}(0.0, theta, p)",
    Port.PLATE_TORQUE: "out[0] += {f}(0.0, theta, omega, p)",
    Port.MOTOR_TORQUE: "out[0] += {f}(0.0, theta, p)",
    Port.DRAG_TORQUE: "out[0] += {f}(0.0, theta, omega, slow, p)",
    Port.TORQUE_SHARE: "out[0] -= p[KT] * current * {f}(0.0, theta, slow, p)",
    Port.VISCOUS_SHARE: "out[0] += p[VISCOUS] * omega * ({f}(1.0, omega, temperature, p) - 1.0)",
    Port.BACK_EMF_SHARE: "out[2] += p[KE] * omega * {f}(0.0, theta, slow, p)",
    Port.RESISTANCE_SHARE: "out[2] += p[RESISTANCE] * current * {f}(0.0, current, slow, p)",
    Port.MOTOR_VOLTAGE: "out[2] += {f}(0.0, current, p)",
    Port.BRIDGE_VOLTAGE: "out[2] += {f}(0.0, current, command, slow, p)",
    Port.CURRENT_SCALE: "out[3] += current * ({f}(1.0, temperature, p) - 1.0)",
    Port.CURRENT_ZERO: "out[3] += {f}(0.0, temperature, p)",
    Port.ENCODER_ANGLE: "out[4] += {f}(theta * p[GEAR], p) / p[GEAR] - theta",
    Port.PLATE_READING: "out[5] += {f}(theta, remembered[SLOW:], p) - theta",
}  # fmt: skip
_FRICTION = (Port.STRIBECK_PEAK, Port.FRICTION_SHARE, Port.FRICTION_TORQUE, Port.FRICTION_AGE, Port.FRICTION_HEAT)
_LEVELS = {
    Port.FRICTION_SHARE: "level *= {f}(1.0, theta, omega, load, bristle, temperature, surplus / level, slow, p)",
    Port.FRICTION_TORQUE: "level += {f}(0.0, theta, omega, load, bristle, temperature, surplus / level, slow, p)",
    Port.FRICTION_AGE: "level = {f}(level, slow, p)",
    Port.FRICTION_HEAT: "level = {f}(level, temperature, p)",
}


def _function(effect: Effect) -> compose.Made:
    """Return a function that fills in what an effect adds.

    The function takes (state, inputs, memory, parameters, out).
    """
    scope: dict[str, Any] = {
        "SLOW": SLOW, "KT": TORQUE_PER_AMPERE, "KE": BACK_EMF, "VISCOUS": VISCOUS, "RESISTANCE": RESISTANCE,
        "GEAR": GEAR_RATIO, "COULOMB": COULOMB, "STICTION": STICTION, "STRIBECK": STRIBECK_VELOCITY, "gauss": gauss,
        "spring_torque": spring_torque, "stop_torque": stop_torque,
    }  # fmt: skip
    lines = [
        "slow = remembered[:SLOW]",
        "for k in range(len(out)): out[k] = 0.0",
        "springs = spring_torque(theta, p)",
        "load = springs + stop_torque(theta, omega, p)",
    ]

    def own(port: Port) -> str:
        made = compose.composed(port, [effect])
        if port is Port.PLATE_READING:
            made = compose.sensed([effect], port, {effect.id: 0})
        scope[port.name] = made
        return port.name

    for port, line in _FINE.items():
        if effect.acts_at(port):
            lines.append(line.format(f=own(port)))
    if effect.acts_at(Port.PLATE_LEAD):
        lines.append(f"lead = {own(Port.PLATE_LEAD)}(0.0, load, p)")
        lines.append("out[5] -= lead")
        lines.append("out[0] += spring_torque(theta - lead, p) + stop_torque(theta - lead, omega, p) - load")
    if effect.acts_at(*_FRICTION):
        lines += ["peak = gauss(omega / p[STRIBECK])", "surplus = (p[STICTION] - p[COULOMB]) * peak"]
        lines.append("before = p[COULOMB] + surplus")
        if effect.acts_at(Port.STRIBECK_PEAK):
            lines.append(f"surplus = (p[STICTION] - p[COULOMB]) * {own(Port.STRIBECK_PEAK)}(peak, omega, p)")
        lines.append("level = p[COULOMB] + surplus")
        lines += [line.format(f=own(port)) for port, line in _LEVELS.items() if effect.acts_at(port)]
        lines.append("out[1] = max(level, 0.02 * p[COULOMB]) / before - 1.0")
    return _compiled(effect.id, _ASKS, lines, scope)


def _passing(effect: Effect) -> compose.Made:
    """Return a function that moves an effect's states by dt s in place.

    The function moves the memory of the effect's sensor, too.
    """
    scope: dict[str, Any] = {"SLOW": SLOW}
    lines = ["slow = remembered[:SLOW]"]
    if effect.states:
        scope["steps"] = compose.steps([effect], of_friction=False)
        lines.append("steps(0.0, omega, travel, current, command, temperature, dt, slow, p)")
    if effect.sensor is not None and effect.acts_at(Port.PLATE_READING):
        scope["sense"] = compose.sensor_steps([effect], Port.PLATE_READING, {effect.id: 0})
        lines.append("sense(remembered[SLOW:], travel, current, p)")
    return _compiled(
        f"pass_{effect.id}", "omega, travel, current, command, temperature, dt, remembered, p", lines, scope
    )


def _compiled(
    name: str, takes: str, lines: list[str], scope: dict[str, Any], *, is_inline: bool = True
) -> compose.Made:
    body = "\n    ".join(lines)
    exec(f"def {name}({takes}):\n    {body}\n", scope)  # noqa: S102 (written here, from checked names)
    return njit(cache=False, error_model="numpy", forceinline=is_inline)(scope[name])


def _along(effect: Effect, function: compose.Made, passing: compose.Made) -> compose.Made:
    """Return a function that fills in what an effect adds along a motion.

    The function goes sample by sample; see `along`.

    Each effect has a loop of its own: one call for each sample costs as much as what it returns.
    """
    scope: dict[str, Any] = {
        "f": function, "passing": passing, "KE": BACK_EMF, "R": RESISTANCE, "L": INDUCTANCE,
        "late": compose.composed(Port.CURRENT_LATENESS, [effect]),
    }  # fmt: skip
    lines = [
        "for k in range(begin, end):",
        "    x, y, o, t = states[k], ahead[k], out[k - begin], temperature[k]",
    ]
    if effect.acts_at(*READINGS, Port.PLATE_LEAD):
        lines += [
            "    v = voltage[max(k - 1, 0)]",
            "    rate = (v - x[5] - p[R] * x[4] - p[KE] * x[1]) / p[L]",
            "    f(x[0], x[1], x[4], v, x[2], t, remembered, p, room)",
            "    delay, lag = late((0.0, 0.0), p)",
            "    o[3] = room[3] - (delay + lag) * rate; o[4] = room[4]; o[5] = room[5]",
        ]
    else:
        lines += ["    o[3] = 0.0; o[4] = 0.0; o[5] = 0.0"]
    lines += [
        "    omega, current, v = 0.5 * (x[1] + y[1]), 0.5 * (x[4] + y[4]), voltage[k]",
        "    f(0.5 * (x[0] + y[0]), omega, current, v, 0.5 * (x[2] + y[2]), t, remembered, p, room)",
        "    o[0] = room[0]; o[1] = room[1]; o[2] = room[2]",
    ]
    if effect.states or effect.sensor:
        lines.append("    if k + 1 < len(states):")
        lines.append("        passing(x[1], states[k + 1, 0] - x[0], x[4], v, t, dt[k], remembered, p)")
    return _compiled(f"along_{effect.id}", _MOTION, lines, scope)


def _chosen(name: str, takes: str, functions: list[compose.Made]) -> compose.Made:
    """Return a function that calls the one of some functions that an index says."""
    scope = {f"f{k}": function for k, function in enumerate(functions)}
    lines = [f"if index == {k}: f{k}({takes})" for k in range(len(functions))]
    return _compiled(name, f"index, {takes}", lines, scope, is_inline=False)


_adding = [_function(effect) for effect in OWN]
_passing_time = [_passing(effect) for effect in OWN]
add = _chosen("add", _ASKS, _adding)
pass_time = _chosen("pass_time", _PASSED, _passing_time)
# Fills in what an effect adds (`out`, (samples, `ADDED`)) from sample `begin` to before `end` of a filtered motion: to
# the readings at their states, else in the middle of the way to the state that was predicted (`ahead`).
along = _chosen("along", _MOTION, [_along(*each) for each in zip(OWN, _adding, _passing_time, strict=True)])
_starts = compose.starts(OWN)
_late = compose.composed(Port.CURRENT_LATENESS, OWN)


@njit(cache=True, error_model="numpy")
def lateness(p: Vector) -> float:
    """Return by how much in s a current is read late; a lag counts as delay."""
    delay, lag = _late((0.0, 0.0), p)
    return float(delay + lag)


@njit(cache=True, error_model="numpy")
def skip(index: int, goes: float, heat: float, temperature: float, dt: float, remembered: Vector, p: Vector) -> None:
    """Move an effect's states by dt s that were not filtered, in place.

    `goes`: how far the plate got in rad; `heat`: mean square of the current, A^2. Sensors begin anew: on which side of
    its play one was left, nothing tells.
    """
    pass_time(index, goes / dt, goes, math.sqrt(heat), 0.0, temperature, dt, remembered, p)
    remembered[SLOW:] = 0.0


@njit(cache=True, error_model="numpy")
def remembered(temperature: float, p: Vector) -> Vector:
    """Return what effects remember at the start of a record.

    The array is float64 (`MEMORY`); `temperature` is in degC.
    """
    found = np.zeros(MEMORY)
    _starts(0.0, temperature, found[:SLOW], p)
    return found
