"""A mass beside the shaft, as a pendulum's, that gravity turns."""

from __future__ import annotations

import math

from etb_hil.plant.effects.effect import Balance, Effect, Need, Parity, strength
from etb_hil.plant.effects.port import Port

_SPAN = "m g l: 1 kg at 0.1 m are 1 N·m"


def torque(theta: float, sine: float, cosine: float) -> float:
    """Return the torque in N·m that brakes at an angle in rad."""
    return sine * math.sin(theta) + cosine * math.cos(theta)


EFFECT = Effect(
    id="gravity_load",
    equation="a sin(theta) + b cos(theta); m g l is the root of a^2 + b^2, and it hangs at the angle atan2(-b, a)",
    balance=Balance.TORQUE,
    parity=Parity.EVEN,
    parameters=(
        strength("sine", "N·m", -30.0, 30.0, (0.02,), _SPAN),
        strength("cosine", "N·m", -30.0, 30.0, (0.02,), _SPAN),
    ),
    looks_like="a torque that follows the sine of the angle, one wave a turn of the shaft, equal in both directions",
    check="turn the shaft by hand: it swings back to the same angle",
    look_alikes=("cogging_torque", "parameter:preload_open"),
    separated_by="turn the machine by 90 degrees about its shaft, and measure again: gravity's phase moves",
    source="a rigid body in a uniform field",
    terms={Port.PLATE_TORQUE: torque},
    needs=frozenset({Need.PENDULUM}),
)
