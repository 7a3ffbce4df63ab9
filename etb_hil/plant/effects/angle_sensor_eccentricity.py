"""The encoder's disc or magnet sits off the shaft's centre."""

from __future__ import annotations

import numpy as np

from etb_hil.plant.effects.effect import Balance, Effect, Parity, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import Vector

_K = row("angle_sensor_eccentricity")
_SPAN = "0.4 to 0.6 % of a turn"

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
    check="magnet or disc of the motor's encoder",
    look_alikes=("cogging_torque", "friction_position_periodic", "torque_ripple"),
    separated_by="second track; the pattern's growth with speed",
    source="encoder data sheets",
)


def measured_angle(angle: Vector, p: Vector) -> Vector:
    """Return what the encoder makes of a motor angle (n) in rad."""
    if not p[_K : _K + 4].any():
        return angle
    once, twice = p[_K] * np.sin(angle) + p[_K + 1] * np.cos(angle), 2.0 * angle
    return angle + once + p[_K + 2] * np.sin(twice) + p[_K + 3] * np.cos(twice)


def true_angle(angle: Vector, p: Vector) -> Vector:
    """Return the motor angle in rad behind a measured one (n)."""
    if not p[_K : _K + 4].any():
        return angle
    true = angle
    for _ in range(6):  # the error's slope is far below one: each round takes it down by that factor
        true = angle - (measured_angle(true, p) - true)
    return true
