"""The current sensor's scale is off."""

from __future__ import annotations

from etb_hil.plant.effects.effect import Balance, Effect, Parity, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import Vector

_K = row("current_sensor_gain")

EFFECT = Effect(
    id="current_sensor_gain",
    equation="i_measured = (1 + a) i",
    balance=Balance.TORQUE,
    parity=Parity.NEITHER,
    parameters=(strength("gain_error", "1", -0.5, 0.6, (0.05,), "5 to 15 %"),),
    looks_like="every torque and the resistance are off by one factor, the back-EMF is right",
    check="a second ammeter",
    look_alikes=("parameter:torque_constant", "parameter:resistance", "magnet_temperature", "friction_load"),
    separated_by="K_e at speed: the voltage balance gives K_t without the current",
    source="sensor data sheets; shunt tolerance",
    limits="only beyond the tolerances of R and the torques",
)


def true_current(current: Vector, p: Vector) -> Vector:
    """Return the current in A behind a measured one (n)."""
    return current / (1.0 + p[_K])


def measured_current(current: Vector, p: Vector) -> Vector:
    """Return what the sensor makes of a current (n) in A."""
    return current * (1.0 + p[_K])
