"""One step of the whole throttle with its derivatives, compiled.

The step has winding, plate and two disturbances.

The winding's equation is solved exactly under the step's constant voltage and the mean back-EMF of its way; the mean
current drives the momentum balance of `motion`. The disturbance torque and voltage are Ornstein-Uhlenbeck processes:
beside random walks a constant torque, or a current's offset, would carry no information at all.
"""

from __future__ import annotations

import math

from etb_hil.base.compiled import njit
from etb_hil.estimation.bristles import decay
from etb_hil.estimation.motion import BENT_MOST, MOVING, advance
from etb_hil.plant.effects.layout import ELASTIC
from etb_hil.plant.exactmath import gauss
from etb_hil.plant.physics import (
    BACK_EMF,
    COULOMB,
    INDUCTANCE,
    RESISTANCE,
    STICTION,
    STOP_DAMPING,
    STOP_HIGH,
    STOP_LOW,
    STOP_STIFFNESS,
    STRIBECK_VELOCITY,
    TORQUE_PER_AMPERE,
    Vector,
    stop_torque,
)
from etb_hil.recording.samples import Float64

# State: angle (rad), velocity (rad/s), bristle torque (N·m), disturbance torque against the motion (N·m), current (A),
# and disturbance voltage, which is lost before the winding (V).
THETA, OMEGA, BRISTLE, TORQUE, CURRENT, VOLTAGE = range(6)
STATES = 6
CORRELATED = 0.5  # s, time constant of both disturbances

# What acts from outside the base equations, held over a step: a braking torque, a share of the friction level, and a
# lost voltage; then the derivatives of the torque by angle and velocity.
BRAKING, LEVEL, LOST, BY_ANGLE, BY_VELOCITY = range(5)
ACTING = 5
# What a sample's end responds to: the first three, held over the sample, and the growth of the braking torque from its
# beginning to its end (N·m), about the mean. What comes late in a sample has moved the plate less at its end.
GROWTH = 3
FORCES = 4
# Fused multiplications and additions save a seventh of the time; a likelihood has its bits on one machine only anyway.
FUSED = {"contract"}
_LONGEST = 0.26e-3  # s: coarser steps show a false gain of the current


@njit(cache=True, error_model="numpy", forceinline=True)
def parts_of(dt: float) -> int:
    """Return in how many steps a sample of dt s is predicted."""
    return int(dt / _LONGEST - 1e-6) + 1


@njit(cache=True, error_model="numpy", forceinline=True)
def growth(part: int, parts: int) -> tuple[float, float]:
    """Return what a torque that grows by 1 over a sample is in a part of it.

    The second value is how much a torque of 1 in that part alone makes it grow, by least squares over all parts.
    """
    then = (part + 0.5) / parts - 0.5
    return then, 12.0 * parts * then / max(parts * parts - 1.0, 1.0)


@njit(cache=True, error_model="numpy", forceinline=True)
def current_at(x: Vector, voltage: float, gains: float, later: float, p: Vector) -> tuple[float, float]:
    """Return the current in A `later` s after a state, and its derivative.

    The derivative is that by the state's current. The winding's equation is solved exactly under a constant voltage and
    the mean velocity of a motion that gains so much, rad/s^2.
    """
    share = math.exp(-p[RESISTANCE] * later / p[INDUCTANCE])
    omega = x[OMEGA] + 0.5 * later * gains
    at_rest = (voltage - x[VOLTAGE] - p[BACK_EMF] * omega) / p[RESISTANCE]
    return at_rest + (x[CURRENT] - at_rest) * share, share


@njit(cache=True, error_model="numpy", forceinline=True, fastmath=FUSED)
def step(
    x: Vector, p: Vector, voltage: float, h: float, grown: float, acting: Vector, rests: float, f: Float64, b: Float64,
    work: Float64,
) -> None:  # fmt: skip
    """Move the state by h s under a voltage in V, with its derivatives.

    `grown`: what a torque that grows by 1 over the sample is in this step. `acting` (`ACTING`): what effects add.
    Below the velocity `rests` in rad/s the disturbance torque stays as it is: a plate at rest shows only the sum of
    that torque and its bristles'.
    `f` (`STATES`, `STATES`): by the state where a sample begins; `b` (`STATES`, `FORCES`): by the braking torque, the
    share of the friction level, the lost voltage and the torque's growth. `work` (2, at least `MOVING`).
    """
    r, by = work[0], work[1]
    coulomb, stiction = p[COULOMB], p[STICTION]
    p[COULOMB], p[STICTION] = coulomb * (1.0 + acting[LEVEL]), stiction * (1.0 + acting[LEVEL])
    end, mean, _ = decay(p[RESISTANCE] * h / p[INDUCTANCE])
    k, resistance, omega = p[TORQUE_PER_AMPERE], p[RESISTANCE], x[OMEGA]
    driven = voltage - x[VOLTAGE] - acting[LOST]
    half = 0.5 * h * omega
    push, stiffness, damping = _stop(x[THETA] + half, omega, p)
    stiffness += acting[BY_ANGLE]
    damping += acting[BY_VELOCITY]
    by_way = -k * (1.0 - mean) * p[BACK_EMF] / (resistance * h) - 0.5 * stiffness - damping / h
    braking = push + acting[BRAKING] - stiffness * half - damping * omega
    motor = k * (mean * x[CURRENT] + (1.0 - mean) * driven / resistance) - braking
    before = x[THETA]
    bend = advance(x, p, p[ELASTIC], motor, by_way, h, MOVING, r, by)
    way = x[THETA] - before
    p[COULOMB], p[STICTION] = coulomb, stiction
    moves = omega * omega / (omega * omega + rests * rests)
    kept, fades = math.exp(-h * moves / CORRELATED), math.exp(-h / CORRELATED)
    x[CURRENT] = end * x[CURRENT] + (1.0 - end) / resistance * (driven - p[BACK_EMF] * way / h)
    x[TORQUE] *= kept
    x[VOLTAGE] *= fades
    per = r[TORQUE]
    by_level = r[MOVING - 1] / (1.0 + acting[LEVEL])
    r[THETA] += stiffness * per
    r[CURRENT] = -per * k * mean
    r[VOLTAGE] = per * k * (1.0 - mean) / resistance
    emf = (1.0 - end) * p[BACK_EMF] / (resistance * h)
    # By the state before: all but a diagonal follows from how the way changes.
    keeps, rises, loses = by[BRISTLE], 2.0 / h, (1.0 - end) / resistance
    for j in range(STATES):
        _carry(f, j, r, rises, bend, keeps, emf, end, loses, kept, fades)
    for j in range(FORCES):
        _carry(b, j, r, rises, bend, keeps, emf, end, loses, kept, fades)
    _push(b, BRAKING, r[TORQUE], rises, bend, emf)
    _push(b, LEVEL, by_level, rises, bend, emf)
    _push(b, LOST, r[VOLTAGE], rises, bend, emf)
    _push(b, GROWTH, grown * r[TORQUE], rises, bend, emf)
    b[BRISTLE, LEVEL] += by[MOVING - 1] / (1.0 + acting[LEVEL])
    b[CURRENT, LOST] -= loses


@njit(cache=True, error_model="numpy", forceinline=True, fastmath=FUSED)
def _carry(
    f: Float64, j: int, r: Vector, rises: float, bend: float, keeps: float, emf: float, end: float, loses: float,
    kept: float, fades: float,
) -> None:  # fmt: skip
    """Carry a column of derivatives over a step, in place."""
    way = r[0] * f[0, j] + r[1] * f[1, j] + r[2] * f[2, j] + r[3] * f[3, j] + r[4] * f[4, j] + r[5] * f[5, j]
    f[CURRENT, j] = end * f[CURRENT, j] - loses * f[VOLTAGE, j] - emf * way
    f[THETA, j] += way
    f[OMEGA, j] = rises * way - f[OMEGA, j]
    f[BRISTLE, j] = bend * way + keeps * f[BRISTLE, j]
    f[TORQUE, j] *= kept
    f[VOLTAGE, j] *= fades


@njit(cache=True, error_model="numpy", forceinline=True)
def _push(b: Float64, j: int, way: float, rises: float, bend: float, emf: float) -> None:
    """Add to a column what a force does within the step, by how it changes the way."""
    b[THETA, j] += way
    b[OMEGA, j] += rises * way
    b[BRISTLE, j] += bend * way
    b[CURRENT, j] -= emf * way


@njit(cache=True, error_model="numpy")
def keep_bristle(x: Vector, p: Vector, level: float) -> None:
    """Keep bristles from being bent further than friction bends them.

    The state changes in place; `level` is a share added to friction.

    A filter that lets them wind up gets the sign of the velocity wrong; then its disturbance runs away.
    """
    g = (p[COULOMB] + (p[STICTION] - p[COULOMB]) * gauss(x[OMEGA] / p[STRIBECK_VELOCITY])) * (1.0 + level)
    x[BRISTLE] = min(max(x[BRISTLE], -BENT_MOST * g), BENT_MOST * g)


@njit(cache=True, error_model="numpy", forceinline=True)
def _stop(theta: float, omega: float, p: Vector) -> tuple[float, float, float]:
    """Return the stops' torque in N·m, with derivatives by angle and velocity."""
    torque = stop_torque(theta, omega, p)
    if torque == 0.0 or p[STOP_LOW] <= theta <= p[STOP_HIGH]:
        return 0.0, 0.0, 0.0
    return torque, p[STOP_STIFFNESS], p[STOP_DAMPING]
