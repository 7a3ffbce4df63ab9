"""The air flow turns the plate."""

from __future__ import annotations

import math

from etb_hil.plant.effects.effect import Balance, Effect, Need, Parity, shape, strength
from etb_hil.plant.effects.port import Port


def torque(theta: float, torque: float, lean: float, peakedness: float, stop_low: float, stop_high: float) -> float:
    """Return the torque in N·m that brakes opening at an angle."""
    if torque == 0.0:
        return 0.0
    x = (theta - stop_low) / (stop_high - stop_low)
    if x <= 0.0 or x >= 1.0:
        return 0.0
    return torque * math.sin(math.pi * x**lean) ** peakedness


EFFECT = Effect(
    id="aerodynamic_torque",
    equation="T_a sin(pi x^m)^q, x = (theta - theta_low) / (theta_high - theta_low)",
    balance=Balance.TORQUE,
    parity=Parity.EVEN,
    parameters=(
        strength("torque", "N·m", -0.03, 0.3, (0.02,), "0.02 to 0.15 N·m: C dp D^3; it closes the plate"),
        shape("lean", "1", 0.3, 3.0, (0.6, 1.0, 1.8), "where over the travel it is largest"),
        shape("peakedness", "1", 0.4, 6.0, (1.0, 2.0), "how narrow it is"),
    ),
    looks_like="a torque humped over the angle, nil at both ends, equal in both directions",
    check="air flow through the throttle during the measurement",
    look_alikes=("spring_nonlinear",),
    separated_by="record at one angle with the air flow on and off",
    source="seed paper, II.C; Morris and Dutton 1989 (butterfly valves)",
    is_of_place=True,
    limits="at a constant pressure difference",
    is_one_way=True,
    terms={Port.PLATE_TORQUE: torque},
    needs=frozenset({Need.THROTTLE}),
)
