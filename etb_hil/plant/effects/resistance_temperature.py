"""Copper that warms, with the housing and by its own current."""

from __future__ import annotations

from numba import njit

from etb_hil.plant.effects.curves import lagged
from etb_hil.plant.effects.effect import Balance, Effect, Parity, shape, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import RESISTANCE, Vector

REFERENCE = 25.0  # degC
COPPER = 0.00393  # 1/K

_K = row("resistance_temperature")

EFFECT = Effect(
    id="resistance_temperature",
    equation=(
        "R (1 + a 0.00393 (T_h - 25 degC) + b 0.00393 dT), tau d(T_h)/dt = T - T_h, tau d(dT)/dt = 10 K/W i^2 R - dT"
    ),
    balance=Balance.VOLTAGE,
    parity=Parity.NEITHER,
    parameters=(
        strength("housing_share", "1", -0.5, 2.5, (0.3,), "1: copper that follows the housing"),
        strength("self_heating", "1", -0.5, 6.0, (0.3,), "1: 10 K/W"),
        shape("time_constant", "s", 1.0, 200.0, (5.0, 15.0, 50.0), "of the winding, by its own heat and the housing's"),
    ),
    looks_like="the resistance drifts with temperature and after high currents",
    check="resistance cold and hot at the plug",
    look_alikes=("supply_sag", "brush_drop", "parameter:resistance"),
    separated_by="stalled current at two levels, cold and hot",
    source="IEC 60034-1 (copper, 1 / (234.5 + 20) K)",
)


@njit(cache=True, error_model="numpy")
def share(housing: float, rise: float, p: Vector) -> float:
    """Return what of the resistance is added; the housing in degC as the winding has followed it, its rise in K."""
    return COPPER * (p[_K] * (housing - REFERENCE) + p[_K + 1] * rise)


@njit(cache=True, error_model="numpy")
def warmed(rise: float, current: float, dt: float, p: Vector) -> float:
    """Return the winding's rise in K after dt s under a current, at 10 K/W."""
    if p[_K + 1] == 0.0:
        return rise
    return lagged(rise, 10.0 * p[RESISTANCE] * current * current, dt, p[_K + 2])


@njit(cache=True, error_model="numpy")
def followed(housing: float, temperature: float, dt: float, p: Vector) -> float:
    """Return the housing's temperature in degC as the winding has it after dt s."""
    if p[_K] == 0.0:
        return housing
    return lagged(housing, temperature, dt, p[_K + 2])
