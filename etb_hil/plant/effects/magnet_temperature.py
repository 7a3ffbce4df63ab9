"""Magnets that weaken with heat."""

from __future__ import annotations

from numba import njit

from etb_hil.plant.effects.curves import lagged
from etb_hil.plant.effects.effect import Balance, Effect, Parity, shape, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import Vector

REFERENCE = 25.0  # degC
FERRITE = -0.002  # 1/K

_K = row("magnet_temperature")

EFFECT = Effect(
    id="magnet_temperature",
    equation="K_t and K_e (1 - a 0.002 (T_m - 25 degC)), T_m follows the housing with a lag",
    balance=Balance.TORQUE,
    parity=Parity.NEITHER,
    parameters=(
        strength("coefficient", "1", -2.0, 8.0, (1.0,), "1: ferrite, -0.2 %/K"),
        shape("time_constant", "s", 0.5, 300.0, (1.0, 10.0, 40.0), "of the magnets behind the housing"),
    ),
    looks_like="torque per ampere and back-EMF fall together as the housing warms",
    check="no-load speed cold and hot",
    look_alikes=("friction_temperature", "current_sensor_gain"),
    separated_by="K_e from the voltage balance at speed, cold and hot",
    source="ferrite data sheets: -0.2 %/K",
    limits="needs the temperature logged, and changing",
)


@njit(cache=True, error_model="numpy")
def share(magnet: float, p: Vector) -> float:
    """Return what is added to the motor constant at a magnet temperature in degC, a share of it."""
    return FERRITE * p[_K] * (magnet - REFERENCE)


@njit(cache=True, error_model="numpy")
def followed(magnet: float, temperature: float, dt: float, p: Vector) -> float:
    """Return the magnets' temperature in degC after dt s in a housing."""
    if p[_K] == 0.0:
        return magnet
    return lagged(magnet, temperature, dt, p[_K + 1])
