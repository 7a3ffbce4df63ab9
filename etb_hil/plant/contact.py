"""Contact with the hard stops, and where inside a step it begins or ends."""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.plant.physics import STOP_DAMPING, STOP_HIGH, STOP_LOW, STOP_STIFFNESS, Values


@njit(cache=True, error_model="numpy", forceinline=True)
def push(theta: float, omega: float, side: float, p: Values) -> float:
    """Return the torque in N·m of the upper (side 1) or lower (-1) stop.

    The torque is above zero where the stop is pressed together.
    """
    edge = p[STOP_HIGH] if side > 0.0 else p[STOP_LOW]
    return side * (p[STOP_STIFFNESS] * (theta - edge) + p[STOP_DAMPING] * omega)


@njit(cache=True, error_model="numpy", forceinline=True)
def beyond(theta: float, p: Values) -> float:
    """Return 1 above the upper stop, -1 below the lower one, else 0."""
    return 1.0 if theta > p[STOP_HIGH] else -1.0 if theta < p[STOP_LOW] else 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def contact_of(theta: float, omega: float, p: Values) -> float:
    """Return the side of the stop that pushes, 0 where none does."""
    side = beyond(theta, p)
    return side if side != 0.0 and push(theta, omega, side, p) > 0.0 else 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def first_root(value: float, rate: float, curvature: float, h: float) -> float:
    """Return the first time in 0 ... h at which a parabola is zero.

    The parabola is value + rate t + curvature t^2 / 2, and has such a time.
    """
    root = np.sqrt(max(rate * rate - 2.0 * curvature * value, 0.0))
    denominator = rate + (root if rate >= 0.0 else -root)
    return min(max(-2.0 * value / denominator, 0.0), h) if denominator != 0.0 else h


@njit(cache=True, error_model="numpy")
def change_of_contact(
    theta: float, omega: float, contact: float, theta_end: float, omega_end: float, h: float, p: Values
) -> tuple[float, float]:
    """Return when in 0 ... h the contact changes, and what it then is.

    The result is h and the old contact where it does not.
    """
    if contact != 0.0:
        push_end = push(theta_end, omega_end, contact, p)
        if push_end > 0.0:
            return h, contact
        pushed = max(push(theta, omega, contact, p), 0.0)
        return h * pushed / (pushed - push_end) if pushed > push_end else 0.0, 0.0
    side = contact_of(theta_end, omega_end, p)
    if side == 0.0:
        return h, contact
    if beyond(theta, p) == 0.0:
        edge = p[STOP_HIGH] if side > 0.0 else p[STOP_LOW]
        return first_root(theta - edge, omega, (omega_end - omega) / h, h), side
    # It had left the stop faster than the stop follows, and meets it again before it is back between the two.
    pulled = min(push(theta, omega, side, p), 0.0)
    return h * pulled / (pulled - push(theta_end, omega_end, side, p)), side
