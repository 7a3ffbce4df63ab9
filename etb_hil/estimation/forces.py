"""What effects add to the base equations along a motion, compiled.

One effect is taken at a time.

An effect declares its terms by port; here they are gathered into the few ways in which anything can act on a throttle.
The derivatives by angle and velocity that a filter needs are differences of these functions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.copying import copy_into
from etb_hil.estimation.throttle import current_at, growth, parts_of
from etb_hil.plant.effects import compose
from etb_hil.plant.effects.catalogue import CATALOGUE, OWN
from etb_hil.plant.effects.effect import Effect, arguments
from etb_hil.plant.effects.layout import SLOW
from etb_hil.plant.effects.port import READINGS, Port
from etb_hil.plant.exactmath import gauss
from etb_hil.plant.physics import (
    BACK_EMF,
    COULOMB,
    DEAD_ZONE,
    GEAR_RATIO,
    INDUCTANCE,
    LIMP_HOME,
    PRELOAD_CLOSE,
    PRELOAD_OPEN,
    RESISTANCE,
    SLOPE_CLOSE,
    SLOPE_OPEN,
    STICTION,
    STOP_DAMPING,
    STOP_HIGH,
    STOP_LOW,
    STOP_STIFFNESS,
    STRIBECK_VELOCITY,
    TORQUE_PER_AMPERE,
    VISCOUS,
    Vector,
    spring_torque,
    stop_torque,
)
from etb_hil.recording.samples import Float64, Int64

# What an effect adds: braking torque (N·m), share of the friction level, lost voltage (V), and to the readings of the
# current (A), the motor's angle and the plate's (rad at the throttle shaft).
BRAKING, LEVEL, LOST, AT_CURRENT, AT_MOTOR, AT_PLATE = range(6)
ADDED = 6
# Behind these, along a motion: how much the braking torque grows over a sample (N·m), see `throttle.growth`.
GROWTH = ADDED
ALONG = ADDED + 1
MEMORY = SLOW + max((one.sensor.size for one in OWN if one.sensor and one.acts_at(Port.PLATE_READING)), default=0)
_INDEX = {effect.id: k for k, effect in enumerate(OWN)}

_BEYOND, _HALVINGS = 1.0, 30  # rad that no play of a sensor has, and how often it is halved: to a nanoradian
_ASKS = "theta, omega, current, command, bristle, temperature, remembered, p, out"
_PASSED = "omega, travel, current, command, temperature, dt, remembered, p"
_BEGUN = "apart, theta, current, temperature, remembered, p"
_MOTION = "begin, end, dt, voltage, temperature, states, ahead, before, read, remembered, coming, read_by, p, room, out"
# The ports of the lateness of each reading, by what is added to it.
_LATE = {Port.CURRENT_LATENESS: AT_CURRENT, Port.MOTOR_LATENESS: AT_MOTOR, Port.PLATE_LATENESS: AT_PLATE}
_lateness = {port: compose.composed(port, OWN) for port in _LATE}
_late_current, _late_motor, _late_plate = _lateness.values()
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
# Terms that change with the angle within a sample: the motor turns by radians in one.
_WITHIN = (Port.SPRINGS, Port.SPRING_TORQUE, Port.MOTOR_TORQUE, Port.TORQUE_SHARE, Port.BACK_EMF_SHARE)
_FRICTION = (Port.STRIBECK_PEAK, Port.FRICTION_SHARE, Port.FRICTION_TORQUE, Port.FRICTION_AGE, Port.FRICTION_HEAT)
_LEVELS = {
    Port.FRICTION_SHARE: "level *= {f}(1.0, theta, omega, load, bristle, temperature, surplus / level, slow, p)",
    Port.FRICTION_TORQUE: "level += {f}(0.0, theta, omega, load, bristle, temperature, surplus / level, slow, p)",
    Port.FRICTION_AGE: "level = {f}(level, slow, p)",
    Port.FRICTION_HEAT: "level = {f}(level, temperature, p)",
}

# The base parameters that a term's place in the equations depends on, by its port, and those behind what it asks for.
_ELASTIC = (
    PRELOAD_OPEN, PRELOAD_CLOSE, SLOPE_OPEN, SLOPE_CLOSE, LIMP_HOME, DEAD_ZONE,
    STOP_LOW, STOP_HIGH, STOP_STIFFNESS, STOP_DAMPING,
)  # fmt: skip
_CURVE = (COULOMB, STICTION, STRIBECK_VELOCITY)
_BASE_AT = {
    Port.SPRINGS: _ELASTIC,
    Port.PLATE_LEAD: _ELASTIC,
    Port.STRIBECK_PEAK: _CURVE,
    Port.FRICTION_TORQUE: _CURVE,
    Port.FRICTION_AGE: _CURVE,
    Port.TORQUE_SHARE: (TORQUE_PER_AMPERE,),
    Port.BACK_EMF_SHARE: (BACK_EMF,),
    Port.VISCOUS_SHARE: (VISCOUS,),
    Port.RESISTANCE_SHARE: (RESISTANCE,),
    Port.CURRENT_LATENESS: (RESISTANCE, INDUCTANCE, BACK_EMF),
}
_BASE_BY = {"load": _ELASTIC, "surplus": _CURVE}


# The plate is behind the motor by what its own load twists: that of springs and stops where it is. It meets a stop
# behind the motor alone. A damped stop takes the load of its velocity at once: the plate stays at its edge then, until
# the twist has that load. So the lead is sought on the side of the edge where the plate is, or the load at the edge, by
# regula falsi (Dowell and Jarratt 1971, "Illinois"), as exactly as differences of the torque need.
_LEAD = [
    "near, far, is_met = 0.0, {f}(0.0, load, p), False",
    "plates = spring_torque(theta - far, p) + stop_torque(theta - far, omega, p)",
    "left, right = far, {f}(0.0, plates, p) - far",
    "if theta > p[STOP_HIGH] or theta < p[STOP_LOW]:",
    "    edge = p[STOP_HIGH] if theta > p[STOP_HIGH] else p[STOP_LOW]",
    "    free, push = spring_torque(edge, p), p[STOP_DAMPING] * omega",
    "    met = free + (max(push, 0.0) if theta > edge else min(push, 0.0))",
    "    gap = theta - edge",
    "    before, after = {f}(0.0, free, p) - gap, {f}(0.0, met, p) - gap",
    "    if before * gap >= 0.0:",
    "        near, left, far = gap, before, before + gap",
    "        plates = spring_torque(theta - far, p)",
    "        right = {f}(0.0, plates, p) - far",
    "    elif after * gap >= 0.0:",
    "        is_met, near, left, far, right, plates = True, free, before, met, after, met",
    "    else:",
    "        far, right, plates = gap, after, met",
    "lead = gap if is_met else far",
    "for k in range(25):",
    "    if abs(right) < 1e-12 or left == right: break",
    "    tried = far - right * (far - near) / (right - left)",
    "    if is_met: plates = tried",
    "    else: lead, plates = tried, spring_torque(theta - tried, p) + stop_torque(theta - tried, omega, p)",
    "    found = {f}(0.0, plates, p) - lead",
    "    if (found > 0.0) == (right > 0.0): left *= 0.5",
    "    else: near, left = far, right",
    "    far, right = tried, found",
    "out[5] -= lead",
    "out[0] += plates - load",
]


@dataclass(frozen=True, slots=True)
class _Terms:
    """The terms of one effect, or of all effects from outside where there is none.

    Those are called by their addresses, so that no kernel is compiled anew for them; what is not there adds nothing.
    """

    effect: Effect | None = None

    @property
    def id(self) -> str:
        """The id of the effect."""
        return "outside" if self.effect is None else self.effect.id

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effect, if it is one of the package."""
        return () if self.effect is None else (self.effect,)

    @property
    def is_open(self) -> bool:
        """Whether they are those of effects from outside."""
        return self.effect is None

    @property
    def has_states(self) -> bool:
        """Whether there may be slow states."""
        return self.effect is None or bool(self.effect.states)

    @property
    def has_sensor(self) -> bool:
        """Whether there is a sensor that remembers the plate's way."""
        return self.effect is not None and self.effect.sensor is not None and self.acts_at(Port.PLATE_READING)

    def acts_at(self, *ports: Port) -> bool:
        """Tell whether there may be a term at one of some ports."""
        return any(port.is_open for port in ports) if self.effect is None else self.effect.acts_at(*ports)

    def at(self, port: Port) -> compose.Made:
        """Return the compiled function of a port."""
        return compose.composed(port, self.effects, is_open=self.is_open and port.is_open)


_TERMS = [*(_Terms(effect) for effect in OWN), _Terms()]
# Whether each effect changes a reading at a state.
_AT_STATE = (
    Port.CURRENT_SCALE, Port.CURRENT_ZERO, Port.ENCODER_ANGLE, Port.PLATE_READING, Port.PLATE_LEAD,
)  # fmt: skip
READS = np.array([terms.acts_at(*_AT_STATE) for terms in _TERMS], np.bool_)
# Whether each effect adds anything at a state: one that makes readings late alone adds nothing.
ADDS = np.array([terms.acts_at(*_FINE, *_FRICTION, Port.PLATE_LEAD) for terms in _TERMS], np.bool_)


def base_of(index: int) -> frozenset[int]:
    """Return the base parameters that an effect's terms depend on, by its number."""
    effects = OWN[index : index + 1] or [one for one in CATALOGUE.values() if one.id not in _INDEX]
    found: set[int] = set()
    for effect in effects:
        for port in effect.terms:
            found.update(_BASE_AT.get(port, ()))
            for name in (name for function in effect.at(port) for name in arguments(function)):
                found.update(_BASE_BY.get(name, ()))
                found.update([compose.BASE[name]] if name in compose.BASE else ())
    return frozenset(found)


def index_of(effect: Effect) -> int:
    """Return the number by which the compiled functions know an effect.

    Those from outside share one.
    """
    return _INDEX.get(effect.id, len(OWN))


def _function(terms: _Terms) -> compose.Made:
    """Return a function that fills in what an effect adds.

    The function takes (state, inputs, memory, parameters, out).
    """
    scope: dict[str, Any] = {
        "SLOW": SLOW, "KT": TORQUE_PER_AMPERE, "KE": BACK_EMF, "VISCOUS": VISCOUS, "RESISTANCE": RESISTANCE,
        "GEAR": GEAR_RATIO, "COULOMB": COULOMB, "STICTION": STICTION, "STRIBECK": STRIBECK_VELOCITY, "gauss": gauss,
        "STOP_HIGH": STOP_HIGH, "STOP_LOW": STOP_LOW, "STOP_DAMPING": STOP_DAMPING,
        "spring_torque": spring_torque, "stop_torque": stop_torque,
    }  # fmt: skip
    lines = [
        "slow = remembered[:SLOW]",
        "for k in range(len(out)): out[k] = 0.0",
        "springs, gap = spring_torque(theta, p), 0.0",
        "load = springs + stop_torque(theta, omega, p)",
    ]

    def own(port: Port) -> str:
        sensed = port is Port.PLATE_READING
        scope[port.name] = compose.sensed(terms.effects, port, {(terms.id, port): 0}) if sensed else terms.at(port)
        return port.name

    for port, line in _FINE.items():
        if terms.acts_at(port):
            lines.append(line.format(f=own(port)))
    if terms.acts_at(Port.PLATE_LEAD):
        lines += [line.format(f=own(Port.PLATE_LEAD)) for line in _LEAD]
    if terms.acts_at(*_FRICTION):
        lines += ["peak = gauss(omega / p[STRIBECK])", "surplus = (p[STICTION] - p[COULOMB]) * peak"]
        lines.append("before = p[COULOMB] + surplus")
        if terms.acts_at(Port.STRIBECK_PEAK):
            lines.append(f"surplus = (p[STICTION] - p[COULOMB]) * {own(Port.STRIBECK_PEAK)}(peak, omega, p)")
        lines.append("level = p[COULOMB] + surplus")
        lines += [line.format(f=own(port)) for port, line in _LEVELS.items() if terms.acts_at(port)]
        lines.append("out[1] = max(level, 0.02 * p[COULOMB]) / before - 1.0")
    return _compiled(terms.id, _ASKS, lines, scope)


def _passing(terms: _Terms) -> compose.Made:
    """Return a function that moves an effect's states by dt s in place.

    The function moves the memory of the effect's sensor, too.
    """
    scope: dict[str, Any] = {"SLOW": SLOW}
    lines = ["slow = remembered[:SLOW]"]
    if terms.has_states:
        scope["steps"] = compose.steps(terms.effects, of_friction=False, is_open=terms.is_open)
        lines.append("steps(0.0, omega, travel, current, command, temperature, dt, slow, p)")
    if terms.has_sensor:
        port = Port.PLATE_READING
        scope["sense"] = compose.sensor_steps(terms.effects, port, {(terms.id, port): 0})
        lines.append("sense(remembered[SLOW:], travel, current, p)")
    return _compiled(
        f"pass_{terms.id}", "omega, travel, current, command, temperature, dt, remembered, p", lines, scope
    )


def _beginning(terms: _Terms, function: compose.Made) -> compose.Made:
    """Return a function that sets a sensor's memory in place where a motion begins.

    On which side of its play a sensor was left, the readings tell: by `apart` rad the plate's is above the motor's. The
    sensor is moved to one end of its memory, and from there as far as its reading asks for.
    """
    lines, scope = ["return"], {"SLOW": SLOW, "ADDED": ADDED, "np": np, "copy_into": copy_into}
    if terms.has_sensor:
        port = Port.PLATE_READING
        scope["sense"] = compose.sensor_steps(terms.effects, port, {(terms.id, port): 0})
        scope["f"] = function
        at = "f(theta, 0.0, current, 0.0, 0.0, temperature, remembered, p, room)"
        lines = [
            "if not np.isfinite(apart): return",
            "room = np.zeros(ADDED)",
            f"sense(remembered[SLOW:], {-_BEYOND}, current, p)",
            "first = remembered.copy()",
            at,
            "least = room[5]",
            f"sense(remembered[SLOW:], {_BEYOND}, current, p)",
            at,
            "grows = room[5] > least",
            f"low, high = 0.0, {_BEYOND}",
            f"for _ in range({_HALVINGS}):",
            "    middle = 0.5 * (low + high)",
            "    copy_into(remembered, 0, first)",
            "    sense(remembered[SLOW:], middle, current, p)",
            f"    {at}",
            "    if (room[5] < apart) == grows: low = middle",
            "    else: high = middle",
        ]
    return _compiled(f"begin_{terms.id}", _BEGUN, lines, scope)


def _compiled(
    name: str, takes: str, lines: list[str], scope: dict[str, Any], *, is_inline: bool = True
) -> compose.Made:
    body = "\n    ".join(lines)
    exec(f"def {name}({takes}):\n    {body}\n", scope)  # noqa: S102 (written here, from checked names)
    return njit(cache=False, error_model="numpy", forceinline=is_inline)(scope[name])


@njit(cache=True, error_model="numpy", forceinline=True)
def without_lag(lag: float, dt: float) -> tuple[float, float]:
    """Return the share of a reading that the next one keeps behind a lag, and a delay.

    Of readings r that come dt s apart behind a first-order lag in s, (r - share * r before) / (1 - share) is a mean of
    what was read since then, without the lag. The delay in s is the age of that mean. A lag below 0 is a delay.
    """
    if lag <= 0.0:
        return 0.0, lag
    share = math.exp(-dt / lag)
    return share, lag - dt * share / (1.0 - share)


@njit(cache=True, error_model="numpy", forceinline=True)
def arrival(reading: int, late: float, dt: float) -> int:
    """Return how many samples behind a state the reading of it is.

    `reading`: 0 the current, 1 and 2 the angles. It is `late` s late, and samples are dt s long. A current that was
    true behind the state follows from it; one before it would follow from noise that has died away. An angle that was
    true before the state follows from the motion until there; behind it, steps of the voltage change it.
    """
    samples = late / dt
    return math.ceil(samples - 1e-6) if reading == 0 else math.floor(samples + 1e-6)


@njit(cache=True, error_model="numpy")
def arrivals(reading: int, late: Vector, dt: Vector) -> Int64:
    """Return `arrival` of each sample (n)."""
    found = np.empty(len(dt), np.int64)
    for k in range(len(dt)):
        found[k] = arrival(reading, late[k], dt[k])
    return found


def _along(terms: _Terms, function: compose.Made, passing: compose.Made) -> compose.Made:
    """Return a function that fills in what an effect adds along a motion.

    The function goes sample by sample; see `along`.

    Each effect has a loop of its own: one call for each sample costs as much as what it returns.
    """
    scope: dict[str, Any] = {
        "f": function, "passing": passing, "current_at": current_at, "without_lag": without_lag, "arrival": arrival,
        "copy_into": copy_into,
    }  # fmt: skip
    late = {port: at for port, at in _LATE.items() if terms.acts_at(port)}
    lines = []
    for port, at in late.items():
        scope[port.name] = _lateness[port]
        lines.append(f"before_{at}, (delay_{at}, lag_{at}) = 0.0, {port.name}((0.0, 0.0), p)")
        lines.append(f"read_delay_{at}, read_lag_{at} = read[{at - AT_CURRENT}, 0], read[{at - AT_CURRENT}, 1]")
    lines += [
        "for k in range(begin, end):",
        "    x, y, o, t = states[k], ahead[k], out[k - begin], temperature[k]",
    ]
    if terms.acts_at(*READINGS, Port.PLATE_LEAD):
        lines += [
            "    v = voltage[max(k - 1, 0)]",
            "    w = before[k, 0]",
            f"    f(w[0], w[1], w[4], v, w[2], t, {'coming' if terms.has_sensor else 'remembered'}, p, room)",
            "    o[3] = room[3]; o[4] = room[4]; o[5] = room[5]",
        ]
        for at in late.values():
            lines += [
                "    h = dt[k]",
                f"    w = before[k, {at - AT_CURRENT}]",
                "    gains = (w[1] - states[max(k - 1, 0), 1]) / h",
                f"    keeps, late = without_lag(read_lag_{at}, h)",
                f"    late += read_delay_{at}",
                f"    arrives = arrival({at - AT_CURRENT}, late, h) * h",
                f"    moved_keeps, moved = without_lag(lag_{at}, h)",
                f"    moved += delay_{at}",
                *(f"    {line}" for line in (_LATE_CURRENT if at == AT_CURRENT else _LATE_ANGLE)),
                f"    if k == begin: before_{at} = now",
                f"    seen = keeps * before_{at} + (1.0 - keeps) * now",
                f"    o[{at}] += then - (seen - moved_keeps * before_{at}) / (1.0 - moved_keeps)",
                f"    before_{at} = seen",
            ]
    else:
        lines += ["    o[3] = 0.0; o[4] = 0.0; o[5] = 0.0"]
    scope["parts_of"], scope["growth"] = parts_of, growth
    within = "coming" if terms.has_states else "remembered"
    lines += [
        "    o[0] = o[1] = o[2] = o[6] = 0.0",
        f"    parts = {'parts_of(dt[k])' if terms.acts_at(*_WITHIN) else '1'}",
        *(f"    {line}" for line in (_WITHIN_SAMPLE if terms.has_states else ())),
        "    for part in range(parts):",
        "        to = (part + 0.5) / parts",
        "        theta, omega = x[0] + to * (y[0] - x[0]), x[1] + to * (y[1] - x[1])",
        "        current, bristle = x[4] + to * (y[4] - x[4]), x[2] + to * (y[2] - x[2])",
        f"        f(theta, omega, current, voltage[k], bristle, t, {within}, p, room)",
        "        o[0] += room[0] / parts; o[1] += room[1] / parts; o[2] += room[2] / parts",
        "        _, grows = growth(part, parts)",
        "        o[6] += room[0] * grows",
    ]
    if terms.has_states or terms.has_sensor:
        lines.append("    if k + 1 < len(states):")
        if terms.has_sensor:
            lines.append("        copy_into(coming, 0, remembered)")
            lines.append("        passing(x[1], y[0] - x[0], x[4], voltage[k], t, dt[k], coming, p)")
        lines.append("        passing(x[1], states[k + 1, 0] - x[0], x[4], voltage[k], t, dt[k], remembered, p)")
    return _compiled(f"along_{terms.id}", _MOTION, lines, scope)


# What is remembered in the middle of a sample, in the place of what was predicted of its beginning.
_WITHIN_SAMPLE = [
    "copy_into(coming, 0, remembered)",
    "passing(x[1], 0.5 * dt[k] * x[1], x[4], voltage[k], t, 0.5 * dt[k], coming, p)",
]
# What arrives behind a state without its lag: `now` by the lateness that it was read with, `then` by another one.
_LATE_CURRENT = [
    "if late != 0.0: v = voltage[k]",
    "now = current_at(w, v, gains, arrives - late, read_by)[0]",
    "then = current_at(w, v, gains, arrives - moved, p)[0]",
]
_LATE_ANGLE = [
    "now = w[0] + (arrives - late) * (w[1] + 0.5 * (arrives - late) * gains)",
    "then = w[0] + (arrives - moved) * (w[1] + 0.5 * (arrives - moved) * gains)",
]


def _chosen(name: str, takes: str, functions: list[compose.Made]) -> compose.Made:
    """Return a function that calls the one of some functions that an index says."""
    scope = {f"f{k}": function for k, function in enumerate(functions)}
    lines = [f"if index == {k}: f{k}({takes})" for k in range(len(functions))]
    return _compiled(name, f"index, {takes}", lines, scope, is_inline=False)


_adding = [_function(terms) for terms in _TERMS]
_passing_time = [_passing(terms) for terms in _TERMS]
add = _chosen("add", _ASKS, _adding)
pass_time = _chosen("pass_time", _PASSED, _passing_time)
begin = _chosen("begin", _BEGUN, [_beginning(*each) for each in zip(_TERMS, _adding, strict=True)])
# Fills in what an effect adds (`out`, (samples, `ALONG`)) from sample `begin` to before `end` of a filtered motion: to
# each reading at the state before it (`before`, (n, 3, `SIZE`)), else on the way to the state that was predicted
# (`ahead`). `read` (3, 2): the delay and the lag in s of each reading by the parameters `read_by` of that filter.
# `coming`: what is remembered at sample `begin` as it was predicted, before readings corrected the way there.
along = _chosen("along", _MOTION, [_along(*each) for each in zip(_TERMS, _adding, _passing_time, strict=True)])
_starts = compose.starts(OWN, is_open=True)


@njit(cache=True, error_model="numpy")
def lateness(p: Vector) -> Float64:
    """Return the delay and the lag in s by which each reading is late (3, 2)."""
    found = np.empty((3, 2))
    found[0, 0], found[0, 1] = _late_current((0.0, 0.0), p)
    found[1, 0], found[1, 1] = _late_motor((0.0, 0.0), p)
    found[2, 0], found[2, 1] = _late_plate((0.0, 0.0), p)
    return found


@njit(cache=True, error_model="numpy")
def skip(index: int, goes: float, heat: float, temperature: float, dt: float, remembered: Vector, p: Vector) -> None:
    """Move an effect's states by dt s that were not filtered, in place.

    `goes`: how far the plate got in rad; `heat`: mean square of the current, A^2. Sensors begin anew (`begin`).
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
