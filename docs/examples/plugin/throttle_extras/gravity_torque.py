"""Gravity turns a plate whose centre of mass is beside its shaft."""

import math

from etb_hil.plugins.effects import Balance, Effect, Need, Parity, Port, shape, strength


def torque(theta: float, moment: float, phase: float) -> float:
    """Return the torque in N·m that closes the plate at an angle in rad."""
    return moment * math.sin(theta + phase)


EFFECT = Effect(
    id="gravity_torque",
    equation="m g l sin(theta + phase)",
    balance=Balance.TORQUE,
    parity=Parity.EVEN,
    parameters=(
        strength("moment", "N·m", -0.3, 0.3, (0.02,), "m g l: 0.1 kg at 2 cm are 0.02 N·m"),
        shape("phase", "rad", -1.6, 1.6, (-1.2, -0.4, 0.4, 1.2), "how the throttle is mounted"),
    ),
    looks_like="a torque that follows the sine of the angle, the same in both directions",
    check="turn the throttle on its side",
    look_alikes=("spring_nonlinear", "aerodynamic_torque"),
    separated_by="repeat the sweep with the throttle turned by 90 degrees about its shaft",
    source="a rigid body in a uniform field",
    terms={Port.PLATE_TORQUE: torque},
    needs=frozenset({Need.THROTTLE}),
)
