"""Both springs are preloaded more, or less, than the model says."""

from __future__ import annotations

from etb_hil.plant.effects.effect import Balance, Effect, Need, Parity, strength
from etb_hil.plant.effects.port import Port


def torque(theta: float, preload: float, limp_home: float, dead_zone: float) -> float:
    """Return the torque in N·m that brakes opening at an angle.

    The torque is smoothed over the dead zone as the springs' own.
    """
    if preload == 0.0:
        return 0.0
    x = theta - limp_home
    u = min(abs(x) / dead_zone, 1.0)
    jump = preload * u * u * (3.0 - 2.0 * u)
    return jump if x > 0.0 else -jump


EFFECT = Effect(
    id="spring_preload_shift",
    equation="T_s side(theta - lh)",
    balance=Balance.TORQUE,
    parity=Parity.EVEN,
    parameters=(strength("preload", "N·m", -0.4, 0.4, (0.02,), "preloads of 0.25 to 0.45 N·m are found"),),
    looks_like="a constant torque towards limp-home that changes its sign there",
    check="check the notch of the spring, and the spring for fatigue",
    look_alikes=("friction_asymmetry", "current_sensor_offset", "parameter:preload_open", "parameter:preload_close"),
    separated_by="sweep through limp-home: a preload changes its sign there",
    source="seed paper, fig. 3",
    is_of_place=True,
    terms={Port.SPRING_TORQUE: torque},
    needs=frozenset({Need.THROTTLE}),
)
