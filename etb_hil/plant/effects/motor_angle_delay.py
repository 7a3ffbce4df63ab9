"""The motor's angle alone arrives late."""

from __future__ import annotations

from etb_hil.plant.effects import late_reading
from etb_hil.plant.effects.effect import Balance, Effect, Need, Parity, SensorMemory
from etb_hil.plant.effects.port import Port

EFFECT = Effect(
    id="motor_angle_delay",
    equation="phi_measured(t) = phi(t - t_d), and through a first-order lag tau",
    balance=Balance.ANGLE,
    parity=Parity.NEITHER,
    parameters=late_reading.parameters("a sampling period to tens of ms: filters, buses", "filter of the sensor"),
    looks_like="the motor's angle is behind the plate's in proportion to the velocity",
    check="check the time stamps and the filter of the motor's angle",
    look_alikes=("angle_delay", "plate_angle_delay"),
    separated_by="compare with a second encoder on the motor's shaft",
    source="sampling; first-order filter",
    is_one_way=True,
    terms={
        Port.MOTOR_LATENESS: late_reading.lateness,
        Port.MOTOR_SEEN: late_reading.motor,
    },
    sensor=SensorMemory(late_reading.MEMORY, late_reading.move),
    needs=frozenset({Need.THROTTLE, Need.MOTOR_ANGLE}),
)
