"""All angles arrive late."""

from __future__ import annotations

from etb_hil.plant.effects import late_reading
from etb_hil.plant.effects.effect import Balance, Effect, Parity, SensorMemory
from etb_hil.plant.effects.port import Port

EFFECT = Effect(
    id="angle_delay",
    equation="theta_measured(t) = theta(t - t_d) of motor and plate, and through a first-order lag tau",
    balance=Balance.ANGLE,
    parity=Parity.NEITHER,
    parameters=late_reading.parameters("a sampling period to tens of ms: filters, buses", "filter of the sensor"),
    looks_like="torque and voltage seem to act ahead of time: errors at every change of the velocity",
    check="check the time stamps and the filter of the angles against those of current and voltage",
    look_alikes=("measurement_delay", "parameter:viscous", "parameter:motor_inertia"),
    separated_by="apply voltage steps, and compare when current and velocity change",
    source="sampling; first-order filter",
    is_one_way=True,
    terms={
        Port.MOTOR_LATENESS: late_reading.lateness,
        Port.MOTOR_SEEN: late_reading.motor,
        Port.PLATE_LATENESS: late_reading.lateness,
        Port.PLATE_SEEN: late_reading.plate,
    },
    sensor=SensorMemory(late_reading.MEMORY, late_reading.move),
)
