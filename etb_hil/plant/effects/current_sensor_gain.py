"""The current sensor's scale is off."""

from __future__ import annotations

from etb_hil.plant.effects.effect import Balance, BenchMeasurement, Effect, Need, Parity, strength
from etb_hil.plant.effects.port import Port


def share(gain_error: float) -> float:
    """Return the share that the sensor adds to a current."""
    return gain_error


EFFECT = Effect(
    id="current_sensor_gain",
    equation="i_measured = (1 + a) i",
    balance=Balance.TORQUE,
    parity=Parity.NEITHER,
    parameters=(strength("gain_error", "1", -0.5, 0.6, (0.05,), "5 to 15 %"),),
    looks_like="every torque and the resistance are off by one factor, the back-EMF is right",
    check="compare the current with a second ammeter",
    look_alikes=("parameter:torque_constant", "parameter:resistance", "magnet_temperature", "friction_load"),
    separated_by="record at a high speed: the voltage balance gives K_t without the current",
    source="sensor data sheets; shunt tolerance",
    limits="only beyond the tolerances of R and the torques",
    terms={Port.CURRENT_SCALE: share},
    needs=frozenset({Need.CURRENT}),
    separated_on_drive="apply a known force, or weigh the moving mass: either gives the scale of the drive's force",
    by_bench=(BenchMeasurement.CURRENT, {"gain_error": 0.005}),
)
