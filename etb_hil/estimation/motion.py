"""One step of the plate's equations with its derivatives, compiled.

Derivatives are by the state and by the parameters.

The momentum balance over a step of h s is solved for the way X that the plate goes:

    2 J (X / h - omega) = h (M(X) - spring(theta + X / 2) - d - F(X)) - sigma_1 (z(X) - z) - sigma_2 X

M is the motor's mean torque, linear in the way: a winding's back-EMF and the end stops depend on it.
The bristles bend as `bristles` has it at the constant velocity X / h; F is their mean torque over the step. One Newton
step from the explicit prediction solves the balance, and the derivatives are those of the implicit function. Every step
of a filter needs two things of them: how the way changes, and how the bristles' end changes at a given way; the rest is
linear in these.
"""

from __future__ import annotations

from etb_hil.base.compiled import njit
from etb_hil.estimation.bristles import bent
from etb_hil.plant.bristle import yielding
from etb_hil.plant.exactmath import gauss
from etb_hil.plant.physics import (
    BRISTLE_DAMPING,
    BRISTLE_STIFFNESS,
    COULOMB,
    DEAD_ZONE,
    INERTIA,
    LIMP_HOME,
    PRELOAD_CLOSE,
    PRELOAD_OPEN,
    SLOPE_CLOSE,
    SLOPE_OPEN,
    STICTION,
    STRIBECK_VELOCITY,
    TORQUE_PER_AMPERE,
    VISCOUS,
    Vector,
)

# State: angle (rad), velocity (rad/s), bristle torque sigma_0 z (N·m), disturbance torque against the motion (N·m), and
# the logarithm of the friction level, which scales T_c and T_st equally.
THETA, OMEGA, BRISTLE, DISTURBANCE, LEVEL = range(5)
MOVING = 5
# Behind it, what may be adapted: logarithms of friction's shape, of inertia and torque constant; the springs' torques.
AT_STICTION, AT_VISCOUS, AT_STIFFNESS, AT_STRIBECK, AT_INERTIA, AT_CONSTANT = range(MOVING, MOVING + 6)
AT_PRELOAD_OPEN, AT_PRELOAD_CLOSE, AT_SLOPE_OPEN, AT_SLOPE_CLOSE = range(MOVING + 6, MOVING + 10)
STATES = MOVING + 10
ADAPTED = (
    STICTION,
    VISCOUS,
    BRISTLE_STIFFNESS,
    STRIBECK_VELOCITY,
    INERTIA,
    TORQUE_PER_AMPERE,
    PRELOAD_OPEN,
    PRELOAD_CLOSE,
    SLOPE_OPEN,
    SLOPE_CLOSE,
)  # their places in the parameter vector, in the order above

BENT_MOST = 1.2  # bristle torque over friction: bristles bent further wind up, and turn the sign of the velocity


@njit(cache=True, error_model="numpy", forceinline=True)
def spring(theta: float, p: Vector) -> tuple[float, float, float]:
    """Return the springs' torque in N·m and its slope in N·m/rad.

    The signed share of preload and slope that acts follows.
    """
    x = theta - p[LIMP_HOME]
    distance, sign = abs(x), 1.0 if x > 0.0 else -1.0
    preload, rise = (p[PRELOAD_OPEN], p[SLOPE_OPEN]) if x > 0.0 else (p[PRELOAD_CLOSE], p[SLOPE_CLOSE])
    whole = preload + rise * distance
    if distance >= p[DEAD_ZONE]:
        return sign * whole, rise, sign
    u = distance / p[DEAD_ZONE]
    share = u * u * (3.0 - 2.0 * u)
    return sign * whole * share, rise * share + whole * 6.0 * u * (1.0 - u) / p[DEAD_ZONE], sign * share


@njit(cache=True, error_model="numpy", forceinline=True)
def _first_way(x: Vector, p: Vector, elastic: float, motor: float, by_way: float, momentum: float, h: float) -> float:
    """Return the way in rad of the explicit prediction.

    The prediction takes the bristles' stiffness into account. `momentum`: N·m·s that a way of 1 rad takes, doubled.
    """
    omega, bristle = x[OMEGA], x[BRISTLE]
    g = p[COULOMB] + (p[STICTION] - p[COULOMB]) * gauss(omega / p[STRIBECK_VELOCITY])
    pull, _, _ = spring(x[THETA] + 0.5 * h * omega, p)
    yields = (1.0 if omega >= 0.0 else -1.0) * bristle / g
    if elastic > 0.0:
        yields = yielding(bristle, omega, g, elastic, 1.0)
    damping = (0.5 * h * p[BRISTLE_STIFFNESS] + p[BRISTLE_DAMPING]) * (1.0 - yields) + p[VISCOUS]
    free = motor - pull - x[DISTURBANCE] - bristle
    return (2.0 * p[INERTIA] * omega + h * free) / (momentum + damping - h * by_way)


@njit(cache=True, error_model="numpy", forceinline=True)
def advance(
    x: Vector, p: Vector, elastic: float, motor: float, motor_by_way: float, h: float, n: int, r: Vector, f: Vector
) -> float:
    """Move the state by h s under the motor's mean torque in N·m.

    Fill in the derivatives by the first n states.

    `elastic`: the share of friction up to which bristles are elastic, 0 for LuGre's.

    `motor`: the torque where the plate stays, `motor_by_way`: its derivative by the way, N·m/rad.

    `r` (n): of the way in rad. `f` (n): of the bristle torque at the end, at a given way. Returns the derivative of the
    latter by the way, N·m/rad.
    """
    theta, omega, bristle = x[THETA], x[OMEGA], x[BRISTLE]
    j, sigma_0, viscous = p[INERTIA], p[BRISTLE_STIFFNESS], p[VISCOUS]
    lag, momentum = p[BRISTLE_DAMPING] / sigma_0, 2.0 * j / h
    way = _first_way(x, p, elastic, motor, motor_by_way, momentum, h)
    per_way = 1.0 / (h * p[STRIBECK_VELOCITY])
    ratio = way * per_way
    shape = gauss(ratio)
    falls = (p[STICTION] - p[COULOMB]) * shape
    g = p[COULOMB] + falls
    pull, stiff, acts = spring(theta + 0.5 * way, p)
    b = bent(bristle, way, g, elastic, sigma_0)
    end, g_by_way = b.end, -2.0 * falls * ratio * per_way
    end_by_way = b.end_by_way + b.end_by_friction * g_by_way
    load_by_way = h * b.mean_by_way + lag * b.end_by_way
    load_by_g = h * b.mean_by_friction + lag * b.end_by_friction
    gains = momentum * way - 2.0 * j * omega
    drag = lag * (end - bristle)
    balance = gains - h * (motor + motor_by_way * way - pull - x[DISTURBANCE] - b.mean) + drag + viscous * way
    by_way = momentum + 0.5 * h * stiff - h * motor_by_way + viscous + load_by_way + load_by_g * g_by_way
    per = -1.0 / by_way
    goes = way + balance * per
    end += end_by_way * balance * per
    r[THETA], r[OMEGA] = h * stiff * per, -2.0 * j * per
    r[BRISTLE] = (h * b.mean_by_bristle + lag * (b.end_by_bristle - 1.0)) * per
    r[DISTURBANCE], r[LEVEL] = h * per, load_by_g * g * per
    f[THETA] = f[OMEGA] = f[DISTURBANCE] = 0.0
    f[BRISTLE], f[LEVEL] = b.end_by_bristle, b.end_by_friction * g
    if n > MOVING:
        by_stiction, by_stribeck = p[STICTION] * shape, 2.0 * falls * ratio * ratio
        r[AT_STICTION], f[AT_STICTION] = load_by_g * by_stiction * per, b.end_by_friction * by_stiction
        r[AT_STRIBECK], f[AT_STRIBECK] = load_by_g * by_stribeck * per, b.end_by_friction * by_stribeck
        r[AT_STIFFNESS], f[AT_STIFFNESS] = (load_by_way * way - drag) * per, b.end_by_way * way
        r[AT_VISCOUS], r[AT_INERTIA], r[AT_CONSTANT] = viscous * goes * per, gains * per, -h * motor * per
        _by_springs(theta + 0.5 * goes - p[LIMP_HOME], h * acts * per, r)
    x[THETA], x[OMEGA], x[BRISTLE] = theta + goes, 2.0 * goes / h - omega, end
    return end_by_way


@njit(cache=True, error_model="numpy", forceinline=True)
def _by_springs(away: float, by_torque: float, r: Vector) -> None:
    """Fill in the derivatives by preloads and slopes, `away` rad from limp-home."""
    opening, closing = (by_torque, 0.0) if away > 0.0 else (0.0, by_torque)
    distance = abs(away)
    r[AT_PRELOAD_OPEN], r[AT_PRELOAD_CLOSE] = opening, closing
    r[AT_SLOPE_OPEN], r[AT_SLOPE_CLOSE] = opening * distance, closing * distance
