"""The current sensor's zero is off."""

from __future__ import annotations

from etb_hil.plant.effects.effect import Balance, Effect, Parity, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import Vector

REFERENCE = 25.0  # degC

_K = row("current_sensor_offset")

EFFECT = Effect(
    id="current_sensor_offset",
    equation="i_measured = i + i_0 + c (T - 25 degC)",
    balance=Balance.TORQUE,
    parity=Parity.EVEN,
    parameters=(
        strength("offset", "A", -1.0, 1.0, (0.02,), "Hall sensors: up to some 0.1 A"),
        strength("drift", "A/K", -0.02, 0.02, (0.0005,), "Hall sensors drift"),
    ),
    looks_like="a constant current is there with the bridge off",
    check="zero of the current and of the voltage with the bridge off: a voltmeter's does the same",
    look_alikes=("friction_asymmetry", "spring_preload_shift"),
    separated_by="zero of the current with the bridge off",
    source="Hall sensor data sheets",
)


def true_current(current: Vector, temperature: Vector, p: Vector) -> Vector:
    """Return the current in A behind a measured one (n)."""
    return current - p[_K] - p[_K + 1] * (temperature - REFERENCE)


def measured_current(current: Vector, temperature: Vector, p: Vector) -> Vector:
    """Return what the sensor makes of a current (n) in A."""
    return current + p[_K] + p[_K + 1] * (temperature - REFERENCE)
