"""The one integrator of the plant, compiled: Strang splitting in whole ticks, bristle solved exactly."""

from __future__ import annotations

import numpy as np
from numba import njit

from etb_hil.plant.exactmath import exp_neg
from etb_hil.plant.physics import (
    BACK_EMF,
    BRISTLE_DAMPING,
    BRISTLE_STIFFNESS,
    INDUCTANCE,
    INERTIA,
    RESISTANCE,
    TORQUE_PER_AMPERE,
    VISCOUS,
    VOLTAGE_LIMIT,
    Vector,
    spring_torque,
    stop_torque,
    stribeck,
)

TICK_NS = 50_000
TICK = 50e-6

THETA = 0
OMEGA = 1
BRISTLE = 2
CURRENT = 3
STATES = 4


def new_state(theta: float) -> Vector:
    """Return the state (float64, `STATES`) of a throttle at rest at an angle in rad, bristles and current at zero."""
    state = np.zeros(STATES)
    state[THETA] = theta
    return state


@njit(cache=True, error_model="numpy")
def _drift(theta: float, omega: float, bristle: float, h: float, p: Vector) -> tuple[float, float]:
    g = stribeck(omega, p)
    speed = abs(omega)
    settled = g / p[BRISTLE_STIFFNESS]
    if omega < 0.0:
        settled = -settled
    decay = exp_neg(p[BRISTLE_STIFFNESS] * speed * h / g)
    return theta + h * omega, settled + (bristle - settled) * decay


@njit(cache=True, error_model="numpy")
def advance(state: Vector, p: Vector, voltage: float, ticks: int) -> None:
    """Move `state` in place by whole ticks of 50 us under a constant voltage in V; NaN is an open bridge."""
    theta, omega, bristle, current = state[THETA], state[OMEGA], state[BRISTLE], state[CURRENT]
    is_open = np.isnan(voltage)
    u = min(max(voltage, -p[VOLTAGE_LIMIT]), p[VOLTAGE_LIMIT])
    for _ in range(ticks):
        theta, bristle = _drift(theta, omega, bristle, 0.5 * TICK, p)
        middle = omega
        for _pass in range(2):
            slope = 1.0 - p[BRISTLE_STIFFNESS] * (1.0 if middle >= 0.0 else -1.0) * bristle / stribeck(middle, p)
            damping = p[VISCOUS] + p[BRISTLE_DAMPING] * slope
            load = p[BRISTLE_STIFFNESS] * bristle + spring_torque(theta, p) + stop_torque(theta, middle, p)
            half = 0.5 * TICK
            if is_open:
                middle_current = 0.0
                middle = (omega - half / p[INERTIA] * load) / (1.0 + half / p[INERTIA] * damping)
            else:
                a = 1.0 + half * p[RESISTANCE] / p[INDUCTANCE]
                b = half * p[BACK_EMF] / p[INDUCTANCE]
                c = half * p[TORQUE_PER_AMPERE] / p[INERTIA]
                d = 1.0 + half * damping / p[INERTIA]
                e = current + half * u / p[INDUCTANCE]
                f = omega - half * load / p[INERTIA]
                middle_current = (e * d - b * f) / (a * d + b * c)
                middle = (f + c * middle_current) / d
        omega = 2.0 * middle - omega
        current = 2.0 * middle_current - current if not is_open else 0.0
        theta, bristle = _drift(theta, omega, bristle, 0.5 * TICK, p)
    state[THETA], state[OMEGA], state[BRISTLE], state[CURRENT] = theta, omega, bristle, current
