"""The equations of the throttle, compiled, for plant, observers and fits.

Everything is at the throttle shaft and in SI. `p` is the parameter vector of `ThrottleParameters.vector()`; the
constants below are its indices. Effects append theirs behind the base parameters.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.compiled import njit
from etb_hil.plant.exactmath import gauss

RESISTANCE = 0
INDUCTANCE = 1
BACK_EMF = 2
TORQUE_PER_AMPERE = 3
GEAR_RATIO = 4
INERTIA = 5
PRELOAD_OPEN = 6
PRELOAD_CLOSE = 7
SLOPE_OPEN = 8
SLOPE_CLOSE = 9
LIMP_HOME = 10
DEAD_ZONE = 11
STOP_LOW = 12
STOP_HIGH = 13
STOP_STIFFNESS = 14
STOP_DAMPING = 15
COULOMB = 16
STICTION = 17
STRIBECK_VELOCITY = 18
BRISTLE_STIFFNESS = 19
BRISTLE_DAMPING = 20
VISCOUS = 21
SUPPLY_VOLTAGE = 22
VOLTAGE_LIMIT = 23
PARAMETERS = 24  # of the base model

Vector = NDArray[np.float64]
Values = Vector | tuple[float, ...]  # a tuple lives in registers: the integrator's loops take it


@njit(cache=True, error_model="numpy", forceinline=True)
def registers(p: Vector) -> Values:
    """Return the base parameters as a tuple."""
    # fmt: off
    return (
        p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11],
        p[12], p[13], p[14], p[15], p[16], p[17], p[18], p[19], p[20], p[21], p[22], p[23],
    )
    # fmt: on


@njit(cache=True, error_model="numpy", forceinline=True)
def spring_torque(theta: float, p: Values) -> float:
    """Return the springs' torque in N·m at an angle in rad.

    The torque is positive where it closes the plate (seed paper, fig. 3).

    The jump at limp-home is smoothed over the dead zone (half width `DEAD_ZONE`) by 3 u^2 - 2 u^3: zero and flat at
    limp-home, the full preload and slope outside, and no kink that would cost the integrator its order.
    """
    x = theta - p[LIMP_HOME]
    distance = abs(x)
    torque = p[PRELOAD_OPEN] + p[SLOPE_OPEN] * distance if x > 0.0 else p[PRELOAD_CLOSE] + p[SLOPE_CLOSE] * distance
    if distance < p[DEAD_ZONE]:
        u = distance / p[DEAD_ZONE]
        torque *= u * u * (3.0 - 2.0 * u)
    return torque if x > 0.0 else -torque


@njit(cache=True, error_model="numpy", forceinline=True)
def stop_torque(theta: float, omega: float, p: Values) -> float:
    """Return the torque of the hard stops in N·m, positive at the upper one.

    Spring and damper push, never pull.
    """
    if theta > p[STOP_HIGH]:
        return max(p[STOP_STIFFNESS] * (theta - p[STOP_HIGH]) + p[STOP_DAMPING] * omega, 0.0)
    if theta < p[STOP_LOW]:
        return min(p[STOP_STIFFNESS] * (theta - p[STOP_LOW]) + p[STOP_DAMPING] * omega, 0.0)
    return 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def stribeck(omega: float, p: Values) -> float:
    """Return g(omega) in N·m: friction of steady sliding without viscosity.

    Source: seed paper, eq. 2.
    """
    return p[COULOMB] + (p[STICTION] - p[COULOMB]) * gauss(omega / p[STRIBECK_VELOCITY])


@njit(cache=True, error_model="numpy", forceinline=True)
def friction_torque(omega: float, bristle: float, p: Values) -> float:
    """Return the LuGre friction torque in N·m at velocity and bristle deflection.

    The deflection is in rad (seed paper, eq. 2).
    """
    rate = omega - p[BRISTLE_STIFFNESS] * abs(omega) / stribeck(omega, p) * bristle
    return p[BRISTLE_STIFFNESS] * bristle + p[BRISTLE_DAMPING] * rate + p[VISCOUS] * omega
