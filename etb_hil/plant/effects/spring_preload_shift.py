"""Both springs are preloaded more, or less, than the model says."""

from __future__ import annotations

from numba import njit

from etb_hil.plant.effects.effect import Balance, Effect, Parity, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import DEAD_ZONE, LIMP_HOME, Vector

_K = row("spring_preload_shift")

EFFECT = Effect(
    id="spring_preload_shift",
    equation="T_s side(theta - lh)",
    balance=Balance.TORQUE,
    parity=Parity.EVEN,
    parameters=(strength("preload", "N·m", -0.4, 0.4, (0.02,), "preloads of 0.25 to 0.45 N·m are found"),),
    looks_like="a constant torque towards limp-home that changes its sign there",
    check="spring fitted in the wrong notch, fatigue",
    look_alikes=("friction_asymmetry", "current_sensor_offset", "parameter:preload_open", "parameter:preload_close"),
    separated_by="a sweep through limp-home: it changes its sign there",
    source="seed paper, fig. 3",
    is_of_place=True,
)


@njit(cache=True, error_model="numpy")
def torque(theta: float, p: Vector) -> float:
    """Return the torque in N·m that brakes opening at an angle; smoothed over the dead zone as the springs' own."""
    if p[_K] == 0.0:
        return 0.0
    x = theta - p[LIMP_HOME]
    u = min(abs(x) / p[DEAD_ZONE], 1.0)
    jump = p[_K] * u * u * (3.0 - 2.0 * u)
    return jump if x > 0.0 else -jump
