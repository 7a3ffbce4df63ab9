"""The supply gives way under the motor's own current."""

from __future__ import annotations

import math

from numba import njit

from etb_hil.plant.effects.curves import lagged
from etb_hil.plant.effects.effect import Balance, Effect, Parity, finer, shape, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import SUPPLY_VOLTAGE, Vector

_K = row("supply_sag")

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
    check="log the supply; clamps and leads",
    look_alikes=("parameter:resistance", "resistance_temperature", "brush_drop", "hbridge_dead_time"),
    separated_by="log the supply voltage at the bridge",
    source="Thevenin source",
    finer=(finer("one_way", "1", 0.0, 1.0, "c: 0.5: a diode takes no current back; 1: it sags by it", 0.25),),
)


@njit(cache=True, error_model="numpy")
def voltage(current: float, command: float, drawn: float, p: Vector) -> float:
    """Return the voltage that is lost at a current, a commanded voltage and a current drawn from the supply."""
    if p[_K] == 0.0 and p[_K + 1] == 0.0:
        return 0.0
    duty = command / p[SUPPLY_VOLTAGE]
    own = drawn if p[_K + 3] > 0.0 else taken(current, command, p)
    return duty * (p[_K] * own + p[_K + 1])


@njit(cache=True, error_model="numpy")
def taken(current: float, command: float, p: Vector) -> float:
    """Return the current that the supply gives."""
    duty = command / p[SUPPLY_VOLTAGE]
    share = math.pow(abs(duty), p[_K + 2]) if duty != 0.0 else 0.0
    drawn = current if command >= 0.0 else -current
    return share * (drawn + p[_K + 4] * (abs(drawn) - drawn))


@njit(cache=True, error_model="numpy")
def drawn(before: float, current: float, command: float, dt: float, p: Vector) -> float:
    """Return the current drawn from the battery behind its capacitor after dt s."""
    if p[_K + 3] <= 0.0:
        return 0.0
    now = taken(current, command, p)
    return lagged(before, now, dt, p[_K + 3])
