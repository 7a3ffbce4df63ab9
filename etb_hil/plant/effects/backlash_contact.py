"""Angle of the plate behind backlash and compliant shaft.

The load on both agrees with their deflection.
"""

from __future__ import annotations

from etb_hil.base.compiled import njit
from etb_hil.plant.effects import ports
from etb_hil.plant.physics import Vector

_FARTHEST = 0.06  # rad between motor and plate
_CLOSE = 2e-9  # rad


@njit(cache=True, error_model="numpy")
def _short(x: float, theta: float, omega: float, swing: float, p: Vector) -> float:
    """Return by how many rad the motor angle is too large under a plate at x.

    The error grows by no less than x does.
    """
    return x + ports.lead(ports.elastic_torque(x, omega, p) + swing, p) - theta


@njit(cache=True, error_model="numpy")
def on_plate(theta: float, guess: float, omega: float, swing: float, p: Vector) -> float:
    """Return the plate's angle in rad under a motor angle.

    `swing` is the torque in N·m that its inertia takes.
    """
    x = min(max(guess, theta - _FARTHEST), theta + _FARTHEST)
    y = _short(x, theta, omega, swing, p)
    if abs(y) < _CLOSE:
        return x
    # What grows as fast as x at least is zero no farther off than it is large.
    other = min(max(x - 1.0001 * y, theta - _FARTHEST), theta + _FARTHEST)
    at_other = _short(other, theta, omega, swing, p)
    if y * at_other >= 0.0:
        return other
    for _ in range(30):
        if abs(at_other) < _CLOSE:
            return other
        between = other - at_other * (other - x) / (at_other - y)
        at_between = _short(between, theta, omega, swing, p)
        if at_between * at_other < 0.0:
            x, y = other, at_other
        else:
            y *= 0.5  # Illinois: the end that stays counts for half
        other, at_other = between, at_between
    return other
