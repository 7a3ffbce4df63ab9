"""Where the plate stands when teeth and shaft give way: what they carry and how far they give agree."""

from __future__ import annotations

from numba import njit

from etb_hil.plant.effects import ports
from etb_hil.plant.physics import Vector

_FARTHEST = 0.06  # rad between motor and plate


@njit(cache=True, error_model="numpy")
def on_plate(theta: float, guess: float, omega: float, swing: float, p: Vector) -> float:
    """Return the plate's angle in rad under a motor angle; `swing` is the torque in N·m that its inertia takes."""
    low, high = theta - _FARTHEST, theta + _FARTHEST
    at_low = low + ports.lead(ports.elastic_torque(low, omega, p) + swing, p) - theta
    at_high = high + ports.lead(ports.elastic_torque(high, omega, p) + swing, p) - theta
    if at_low >= 0.0:
        return low
    if at_high <= 0.0:
        return high
    x = min(max(guess, low + 1e-9), high - 1e-9)
    for _ in range(30):
        y = x + ports.lead(ports.elastic_torque(x, omega, p) + swing, p) - theta
        if abs(y) < 1e-9:
            break
        if y < 0.0:
            low, at_low = x, y
            at_high *= 0.5
        else:
            high, at_high = x, y
            at_low *= 0.5
        x = low - at_low * (high - low) / (at_high - at_low)
        if high - low < 1e-9:
            break
    return x
