"""Voltage lost between brushes and commutator."""

from __future__ import annotations

import math

from numba import njit

from etb_hil.plant.effects.effect import Balance, Effect, Parity, shape, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import Vector

_K = row("brush_drop")

EFFECT = Effect(
    id="brush_drop",
    equation="V_b tanh(i / i_0)",
    balance=Balance.VOLTAGE,
    parity=Parity.EVEN,
    parameters=(
        strength("drop", "V", -0.3, 2.5, (0.1,), "0.3 to 1.5 V"),
        shape("knee", "A", 0.01, 0.3, (0.05, 0.15), "current at which the drop is there"),
    ),
    looks_like="a constant voltage is missing, with the sign of the current",
    check="brushes; stalled current at two levels: the intercept",
    look_alikes=("hbridge_dead_time", "parameter:resistance", "supply_sag"),
    separated_by="duty staircase at two supply voltages and with the bridge off",
    source="carbon brush data sheets",
)


@njit(cache=True, error_model="numpy")
def voltage(current: float, p: Vector) -> float:
    """Return the voltage that is lost at a current."""
    return p[_K] * math.tanh(current / p[_K + 1]) if p[_K] != 0.0 else 0.0
