"""The one integrator of the plant, compiled: second order, whole ticks of 50 us, never unstable in the bristles.

Over a step the velocity is taken as linear in time; armature current and bristles then have closed solutions, and one
linear equation for the velocity at the end remains. Contact with a stop and the end of the freewheeling current are
found inside the step.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from etb_hil.plant.bristle import strain
from etb_hil.plant.exactmath import exp_neg
from etb_hil.plant.physics import (
    BACK_EMF,
    BRISTLE_DAMPING,
    BRISTLE_STIFFNESS,
    COULOMB,
    INDUCTANCE,
    INERTIA,
    RESISTANCE,
    STICTION,
    STOP_DAMPING,
    STOP_HIGH,
    STOP_LOW,
    STOP_STIFFNESS,
    STRIBECK_VELOCITY,
    SUPPLY_VOLTAGE,
    TORQUE_PER_AMPERE,
    VISCOUS,
    VOLTAGE_LIMIT,
    Vector,
    spring_torque,
    stribeck,
)

TICK_NS = 50_000
TICK = 50e-6

THETA = 0
OMEGA = 1
BRISTLE = 2
CURRENT = 3
STATES = 4

_INSTANT = 1e-15  # in s; a stretch too short for anything to move
_EVENTS = 8  # in one step: stop entered, left, current gone; more means chatter below the resolution of the step


def new_state(theta: float) -> Vector:
    """Return the state (float64, `STATES`) of a throttle at rest at an angle in rad, bristles and current at zero."""
    state = np.zeros(STATES)
    state[THETA] = theta
    return state


@njit(cache=True, error_model="numpy")
def _armature(h: float, p: Vector) -> tuple[float, float, float, float]:
    """Return exp(-x), phi_1, phi_2 and phi_3 at x = R h / L: the armature's answer to a linear voltage."""
    x = p[RESISTANCE] * h / p[INDUCTANCE]
    if x > 1.0:
        decay = exp_neg(x)
        phi_1 = (1.0 - decay) / x
        phi_2 = (1.0 - phi_1) / x
        return decay, phi_1, phi_2, (0.5 - phi_2) / x
    phi_3 = 0.0
    for k in range(18, 2, -1):
        phi_3 = (1.0 - x * phi_3) / k
    phi_3 *= 0.5
    phi_2 = 0.5 - x * phi_3
    phi_1 = 1.0 - x * phi_2
    return 1.0 - x * phi_1, phi_1, phi_2, phi_3


@njit(cache=True, error_model="numpy")
def _push(theta: float, omega: float, side: float, p: Vector) -> float:
    """Return the torque of the upper (side 1) or lower (-1) stop, above zero where it is pressed together."""
    edge = p[STOP_HIGH] if side > 0.0 else p[STOP_LOW]
    return side * (p[STOP_STIFFNESS] * (theta - edge) + p[STOP_DAMPING] * omega)


@njit(cache=True, error_model="numpy")
def _beyond(theta: float, p: Vector) -> float:
    """Return 1 above the upper stop, -1 below the lower one, else 0."""
    return 1.0 if theta > p[STOP_HIGH] else -1.0 if theta < p[STOP_LOW] else 0.0


@njit(cache=True, error_model="numpy")
def _contact(theta: float, omega: float, p: Vector) -> float:
    """Return the side of the stop that pushes, 0 where none does."""
    side = _beyond(theta, p)
    return side if side != 0.0 and _push(theta, omega, side, p) > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def _step(theta, omega, bristle, current, g, h, u, armature, contact, p):
    decay, phi_1, phi_2, phi_3 = armature
    sigma_0, sigma_1, sigma_2 = p[BRISTLE_STIFFNESS], p[BRISTLE_DAMPING], p[VISCOUS]
    edge = p[STOP_HIGH] if contact > 0.0 else p[STOP_LOW]
    stop_k, stop_c = (p[STOP_STIFFNESS], p[STOP_DAMPING]) if contact != 0.0 else (0.0, 0.0)
    # predictor
    torque = (
        p[TORQUE_PER_AMPERE] * current
        - sigma_0 * bristle
        - sigma_1 * (omega - sigma_0 * abs(omega) * bristle / g)
        - sigma_2 * omega
        - spring_torque(theta, p)
        - stop_k * (theta - edge)
        - stop_c * omega
    )
    guess = omega + h * torque / p[INERTIA]
    v = (u - p[BACK_EMF] * omega) / p[INDUCTANCE]
    fixed_current = phi_1 * current + h * (phi_2 - phi_3) * v
    passes = 2 if omega * guess < 0.0 else 1
    inertia = p[INERTIA] / h
    for _ in range(passes):
        ratio = guess / p[STRIBECK_VELOCITY]
        gauss = (p[STICTION] - p[COULOMB]) * exp_neg(ratio * ratio)
        g_guess = p[COULOMB] + gauss
        end, mean, end_by, mean_by = strain(bristle, omega, guess, g, g_guess, h, p)
        load = (
            sigma_0 * (mean - mean_by * guess)
            + sigma_1 / h * (end - end_by * guess - bristle)
            + 0.5 * sigma_2 * omega
            + spring_torque(theta + h * (2.0 * omega + guess) / 6.0, p)
            + stop_k * (theta + h * omega / 3.0 - edge)
            + 0.5 * stop_c * omega
        )
        drag = (
            sigma_0 * mean_by
            + sigma_1 / h * end_by
            + 0.5 * sigma_2
            + stop_k * h / 6.0
            + 0.5 * stop_c
            + p[TORQUE_PER_AMPERE] * p[BACK_EMF] / p[INDUCTANCE] * h * phi_3
        )
        drive = p[TORQUE_PER_AMPERE] * (fixed_current + h * phi_3 * u / p[INDUCTANCE])
        new = (inertia * omega + drive - load) / (inertia + drag)
        end += end_by * (new - guess)
        g_new = g_guess - 2.0 * ratio / p[STRIBECK_VELOCITY] * gauss * (new - guess)
        guess = new
    v_new = (u - p[BACK_EMF] * guess) / p[INDUCTANCE]
    current_new = decay * current + h * (phi_1 - phi_2) * v + h * phi_2 * v_new
    return theta + 0.5 * h * (omega + guess), guess, end, current_new, g_new


@njit(cache=True, error_model="numpy")
def _root(value: float, rate: float, curvature: float, h: float) -> float:
    """Return the time in 0 ... h at which value + rate t + curvature t^2 / 2 is zero, value and result being near."""
    root = np.sqrt(max(rate * rate - 2.0 * curvature * value, 0.0))
    time = -2.0 * value / (rate + (root if rate >= 0.0 else -root))
    return min(max(time, 0.0), h)


@njit(cache=True, error_model="numpy")
def advance(state: Vector, p: Vector, voltage: float, ticks: int) -> None:
    """Move `state` in place by whole ticks of 50 us under a constant voltage in V; NaN is an open bridge.

    The voltage is limited to what the bridge gives. With the bridge open, the diodes put the supply against the
    current until it is gone.
    """
    theta, omega, bristle, current = state[THETA], state[OMEGA], state[BRISTLE], state[CURRENT]
    off = np.isnan(voltage)
    u = min(max(voltage, -p[VOLTAGE_LIMIT]), p[VOLTAGE_LIMIT])
    if off:
        u = -p[SUPPLY_VOLTAGE] if current > 0.0 else p[SUPPLY_VOLTAGE]
    conducting = not off or current != 0.0
    g = stribeck(omega, p)
    whole = _armature(TICK, p) if conducting else (0.0, 0.0, 0.0, 0.0)
    contact = _contact(theta, omega, p)
    for _ in range(ticks):
        left = TICK
        armature = whole
        for event in range(_EVENTS):
            th, om, br, cu, gn = _step(theta, omega, bristle, current, g, left, u, armature, contact, p)
            part, contact_new, gone = left, contact, False
            if event < _EVENTS - 1:
                if contact != 0.0:
                    push_new = _push(th, om, contact, p)
                    if push_new <= 0.0:
                        push = _push(theta, omega, contact, p)
                        part, contact_new = left * max(push, 0.0) / (max(push, 0.0) - push_new), 0.0
                else:
                    contact_new = _contact(th, om, p)
                    if contact_new != 0.0:
                        if _beyond(theta, p) == 0.0:
                            edge = p[STOP_HIGH] if contact_new > 0.0 else p[STOP_LOW]
                            part = _root(theta - edge, omega, (om - omega) / left, left)
                        else:
                            push, push_new = _push(theta, omega, contact_new, p), _push(th, om, contact_new, p)
                            part = left * min(push, 0.0) / (min(push, 0.0) - push_new)
                if off and conducting and cu * current <= 0.0:
                    rate = (u - p[RESISTANCE] * current - p[BACK_EMF] * omega) / p[INDUCTANCE]
                    end = _root(current, rate, 2.0 * (cu - current - rate * left) / (left * left), left)
                    if end <= part:
                        gone = True
                        if end < part:
                            part, contact_new = end, contact
            if part < left:
                if part > _INSTANT:
                    armature = _armature(part, p) if conducting else whole
                    th, om, br, cu, gn = _step(theta, omega, bristle, current, g, part, u, armature, contact, p)
                else:
                    th, om, br, cu, gn = theta, omega, bristle, current, g
            theta, omega, bristle, current, g, contact = th, om, br, cu, gn, contact_new
            if gone:
                current, conducting = 0.0, False
                whole = (0.0, 0.0, 0.0, 0.0)
            left -= part
            if left <= _INSTANT:
                break
            armature = _armature(left, p) if conducting else whole
    state[THETA], state[OMEGA], state[BRISTLE], state[CURRENT] = theta, omega, bristle, current
