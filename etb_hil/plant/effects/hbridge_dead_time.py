"""Voltage lost in the bridge's dead times, about zero current less."""

from __future__ import annotations

import math

from etb_hil.plant.effects.effect import Balance, BenchMeasurement, Effect, Need, Parity, finer, shape, strength
from etb_hil.plant.effects.port import Port


def voltage(current: float, error: float, ripple_current: float, sharpness: float, flatness: float) -> float:
    """Return the voltage that is lost at a current."""
    if error == 0.0:
        return 0.0
    x = abs(current) / ripple_current
    if x < 1e-9:
        return 0.0
    y = math.pow(x, 1.0 + flatness) if flatness != 0.0 else x
    share = math.pow(1.0 + math.pow(y, -sharpness), -1.0 / sharpness)
    return error * (share if current > 0.0 else -share)


EFFECT = Effect(
    id="hbridge_dead_time",
    name="H-bridge dead time",
    equation="V_d sign(i) (1 + y^-m)^(-1/m), y = (abs(i) / i_0)^(1 + q); V_d = 2 t_d f_pwm U; none with the bridge off",
    balance=Balance.VOLTAGE,
    parity=Parity.EVEN,
    parameters=(
        strength("error", "V", -0.3, 2.5, (0.1,), "0.5 to 2 us at 10 to 20 kHz"),
        shape("ripple_current", "A", 0.05, 1.5, (0.2, 0.5), "half the current's ripple"),
        shape("sharpness", "1", 1.0, 12.0, (2.0, 6.0), "how sharply the error saturates"),
    ),
    looks_like="small duties do nothing, large ones lose a constant voltage",
    check="change the PWM frequency: the error grows with it",
    look_alikes=("brush_drop", "supply_sag"),
    separated_by="run a duty staircase at two supply voltages and two PWM frequencies",
    source="Choi and Sul 1996 (inverter dead time)",
    finer=(
        finer("flatness", "1", -0.3, 1.5, "q: 0 in proportion about zero, more: the current is clamped there", 0.25),
    ),
    terms={Port.BRIDGE_VOLTAGE: voltage},
    needs=frozenset({Need.CURRENT}),
    by_bench=(BenchMeasurement.BRIDGE, {"error": 0.02}),
)
