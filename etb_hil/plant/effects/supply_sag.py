"""The supply gives way under the motor's own current."""

from __future__ import annotations

import math

from etb_hil.base.compiled import njit
from etb_hil.plant.effects.curves import lagged
from etb_hil.plant.effects.effect import Balance, BenchMeasurement, Effect, Need, Parity, State, finer, shape, strength
from etb_hil.plant.effects.port import Port


def voltage(
    current: float,
    command: float,
    drawn: float,
    source_resistance: float,
    static_sag: float,
    duty_exponent: float,
    time_constant: float,
    one_way: float,
    supply_voltage: float,
) -> float:
    """Return the voltage that is lost at a current and a commanded voltage.

    A current drawn from the supply counts, too.
    """
    if source_resistance == 0.0 and static_sag == 0.0:
        return 0.0
    duty = command / supply_voltage
    own = drawn if time_constant > 0.0 else _taken(current, duty, duty_exponent, one_way)
    return duty * (source_resistance * own + static_sag)


def draw(
    drawn: float,
    current: float,
    command: float,
    dt: float,
    duty_exponent: float,
    time_constant: float,
    one_way: float,
    supply_voltage: float,
) -> float:
    """Return the current drawn from the battery behind its capacitor after dt s."""
    if time_constant <= 0.0:
        return 0.0
    return lagged(drawn, _taken(current, command / supply_voltage, duty_exponent, one_way), dt, time_constant)


@njit(cache=True, error_model="numpy")
def _taken(current: float, duty: float, duty_exponent: float, one_way: float) -> float:
    """Return the current that the supply gives."""
    share = math.pow(abs(duty), duty_exponent) if duty != 0.0 else 0.0
    drawn = current if duty >= 0.0 else -current
    return share * (drawn + one_way * (abs(drawn) - drawn))


EFFECT = Effect(
    id="supply_sag",
    equation=("u = d (U_bat - R_s (abs(d)^m ((1 - c) i sign(d) + c abs(i)) + i_other)), d = u_commanded / U_bat"),
    balance=Balance.VOLTAGE,
    parity=Parity.EVEN,
    parameters=(
        strength("source_resistance", "ohm", -0.3, 3.0, (0.1,), "long leads, weak battery: 6 to 16 V"),
        strength("static_sag", "V", -6.0, 6.0, (0.2,), "what others draw, or the battery itself"),
        shape("duty_exponent", "1", 0.0, 1.5, (0.0, 1.0), "0: the current itself; 1: its share drawn from the supply"),
        shape("time_constant", "s", 0.0, 0.6, (0.0,), "of the supply's capacitor"),
    ),
    looks_like="less voltage than commanded at high duty and current",
    check="log the supply voltage; check clamps and leads",
    look_alikes=("parameter:resistance", "resistance_temperature", "brush_drop", "hbridge_dead_time"),
    separated_by="log the supply voltage at the bridge",
    source="Thevenin source",
    finer=(finer("one_way", "1", 0.0, 1.0, "c: 0.5: a diode takes no current back; 1: it sags by it", 0.25),),
    terms={Port.BRIDGE_VOLTAGE: voltage},
    states=(State("drawn", draw),),
    needs=frozenset({Need.CURRENT}),
    by_bench=(BenchMeasurement.SUPPLY, {"source_resistance": 0.02, "static_sag": 0.03}),
)
