"""The encoder's disc or magnet sits off the shaft's centre."""

from __future__ import annotations

import numpy as np

from etb_hil.plant.effects.effect import Balance, Effect, Need, Parity, strength
from etb_hil.plant.effects.port import Port
from etb_hil.plant.physics import Vector

_SPAN = "0.4 to 0.6 % of a turn"


def reading(angle: Vector, sine: float, cosine: float, second_sine: float, second_cosine: float) -> Vector:
    """Return what the encoder makes of a motor angle in rad."""
    once, twice = sine * np.sin(angle) + cosine * np.cos(angle), 2.0 * angle
    return angle + once + second_sine * np.sin(twice) + second_cosine * np.cos(twice)


EFFECT = Effect(
    id="angle_sensor_eccentricity",
    equation="phi_measured = phi + a sin(phi) + b cos(phi) + c sin(2 phi) + d cos(2 phi), phi the motor's angle",
    balance=Balance.ANGLE,
    parity=Parity.EVEN,
    parameters=(
        strength("sine", "rad", -0.5, 0.5, (0.02,), _SPAN),
        strength("cosine", "rad", -0.5, 0.5, (0.02,), _SPAN),
        strength("second_sine", "rad", -0.3, 0.3, (), "tilted disc"),
        strength("second_cosine", "rad", -0.3, 0.3, (), "tilted disc"),
    ),
    looks_like="an angle error once a motor turn, a velocity ripple that grows with speed",
    check="inspect the magnet or disc of the motor's encoder",
    look_alikes=("cogging_torque", "friction_position_periodic", "torque_ripple"),
    separated_by="record at two speeds, and compare with a second track: the error grows with speed",
    source="encoder data sheets",
    terms={Port.ENCODER_ANGLE: reading},
    needs=frozenset({Need.THROTTLE, Need.MOTOR_ANGLE}),
)
