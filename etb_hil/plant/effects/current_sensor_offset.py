"""The current sensor's zero is off."""

from __future__ import annotations

from etb_hil.plant.effects.effect import REFERENCE, Balance, BenchMeasurement, Effect, Need, Parity, strength
from etb_hil.plant.effects.port import Port


def zero(offset: float) -> float:
    """Return the current in A that the sensor reads at none."""
    return offset


def drifted(temperature: float, drift: float) -> float:
    """Return by how much in A the zero has moved at a temperature in degC."""
    return drift * (temperature - REFERENCE)


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
    check="read the current and the voltage with the bridge off: an offset of the voltmeter looks the same",
    look_alikes=("friction_asymmetry", "spring_preload_shift"),
    separated_by="read the current with the bridge off",
    source="Hall sensor data sheets",
    terms={Port.CURRENT_ZERO: (zero, drifted)},
    needs=frozenset({Need.CURRENT}),
    by_bench=(BenchMeasurement.CURRENT, {"offset": 0.005}),
)
