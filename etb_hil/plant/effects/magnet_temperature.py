"""Magnets that weaken with heat."""

from __future__ import annotations

from etb_hil.plant.effects.curves import lagged
from etb_hil.plant.effects.effect import (
    REFERENCE,
    Balance,
    BenchMeasurement,
    Effect,
    Law,
    Need,
    Parity,
    State,
    shape,
    strength,
)
from etb_hil.plant.effects.port import Port

FERRITE = -0.002  # 1/K


def share(magnet: float, coefficient: float) -> float:
    """Return the share of the motor constant added at a magnet temperature (degC)."""
    return FERRITE * coefficient * (magnet - REFERENCE)


def start(temperature: float) -> float:
    """Return the temperature in degC of magnets that have long been in a housing."""
    return temperature


def follow(magnet: float, temperature: float, dt: float, coefficient: float, time_constant: float) -> float:
    """Return the magnets' temperature in degC after dt s in a housing."""
    if coefficient == 0.0:
        return magnet
    return lagged(magnet, temperature, dt, time_constant)


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
    check="measure the no-load speed cold and hot",
    look_alikes=("friction_temperature", "current_sensor_gain"),
    separated_by="record at a high speed, cold and hot: the voltage balance gives K_e",
    source="ferrite data sheets: -0.2 %/K",
    limits="needs the temperature logged, and changing",
    terms={Port.TORQUE_SHARE: share, Port.BACK_EMF_SHARE: share},
    states=(State("magnet", follow, start),),
    needs=frozenset({Need.TEMPERATURE}),
    without_current_like=("resistance_temperature",),
    by_bench=(BenchMeasurement.MAGNETS, {"coefficient": 0.1}),
    laws=(Law(("torque_constant", "back_emf_constant"), "coefficient", FERRITE, "time_constant"),),
)
