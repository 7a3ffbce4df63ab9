"""The plate sensor lags its shaft."""

from __future__ import annotations

from etb_hil.plant.effects.effect import Balance, Effect, Need, Parity, SensorMemory, shape, strength
from etb_hil.plant.effects.port import Port
from etb_hil.plant.physics import Vector


def step(memory: Vector, travel: float, half_width: float, sharpness: float) -> None:
    """Take in a travel of the shaft in rad: how far in rad the sensor lags."""
    half = max(abs(half_width), 1e-6)
    if memory[0] * travel >= 0.0:
        travel *= 1.0 - min(abs(memory[0]) / half, 1.0) ** sharpness
    memory[0] = min(max(memory[0] + travel, -half), half)


def reading(plate: float, memory: Vector, half_width: float) -> float:
    """Return what the sensor makes of a plate angle in rad."""
    if half_width == 0.0:
        return plate
    return plate - memory[0] if half_width > 0.0 else plate + memory[0]


EFFECT = Effect(
    id="sensor_hysteresis",
    equation="theta_measured = play of half width h, softened: dy = d theta (abs(e) / h)^m where e grows",
    balance=Balance.ANGLE,
    parity=Parity.ODD,
    parameters=(
        strength("half_width", "rad", -0.0005, 0.03, (0.0015,), "0.25 %, up to 0.27 deg"),
        shape("sharpness", "1", 0.3, 20.0, (20.0, 1.5), "20: free play; less: a rounded loop"),
    ),
    looks_like="the plate sensor lags by a constant amount, by direction",
    check="compare with a second sensor",
    look_alikes=("gear_backlash",),
    separated_by="fit a second sensor to the same shaft",
    source="sensor data sheets",
    is_one_way=True,
    terms={Port.PLATE_READING: reading},
    sensor=SensorMemory(1, step),
    needs=frozenset({Need.MOTOR_ANGLE, Need.PLATE_ANGLE}),
)
