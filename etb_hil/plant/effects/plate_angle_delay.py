"""The plate's angle alone arrives late."""

from __future__ import annotations

from etb_hil.plant.effects import late_reading
from etb_hil.plant.effects.effect import Balance, Effect, Need, Parity, SensorMemory
from etb_hil.plant.effects.port import Port

EFFECT = Effect(
    id="plate_angle_delay",
    equation="theta_measured(t) = theta(t - t_d), and through a first-order lag tau",
    balance=Balance.ANGLE,
    parity=Parity.NEITHER,
    parameters=late_reading.parameters("a sampling period to tens of ms: filters, buses", "filter of the sensor"),
    looks_like="the plate's angle is behind the motor's in proportion to the velocity",
    check="check the time stamps and the filter of the plate's sensor",
    look_alikes=("sensor_hysteresis", "gear_backlash", "shaft_compliance"),
    separated_by="move at two constant speeds: play is the same at both, a delay grows with the speed",
    source="sampling; first-order filter",
    is_one_way=True,
    terms={
        Port.PLATE_LATENESS: late_reading.lateness,
        Port.PLATE_SEEN: late_reading.plate,
    },
    sensor=SensorMemory(late_reading.MEMORY, late_reading.move),
    needs=frozenset({Need.PLATE_ANGLE}),
)
