"""The current arrives late."""

from __future__ import annotations

from etb_hil.plant.effects import late_reading
from etb_hil.plant.effects.effect import Balance, Effect, Need, Parity, SensorMemory
from etb_hil.plant.effects.port import Port

EFFECT = Effect(
    id="measurement_delay",
    equation="i_measured(t) = i(t - t_d), and through a first-order lag tau",
    balance=Balance.TORQUE,
    parity=Parity.NEITHER,
    parameters=late_reading.parameters(
        "0.5 to 10 ms: filters, multiplexing", "anti-alias filter, or one for a display: to 0.3 s", 0.5
    ),
    looks_like="errors at every change of the current, none where it is constant",
    check="check the time stamps and the filter of the current channel",
    look_alikes=("parameter:inductance", "parameter:viscous", "parameter:motor_inertia"),
    separated_by="apply voltage steps, and compare when voltage and current change",
    source="sampling; first-order filter",
    is_one_way=True,
    terms={Port.CURRENT_LATENESS: late_reading.lateness, Port.CURRENT_READING: late_reading.current},
    sensor=SensorMemory(late_reading.MEMORY, late_reading.take_in),
    needs=frozenset({Need.DRIVING}),
)
