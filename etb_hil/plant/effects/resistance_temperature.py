"""Copper that warms, with the housing and by its own current."""

from __future__ import annotations

from etb_hil.plant.effects.curves import lagged
from etb_hil.plant.effects.effect import REFERENCE, Balance, Effect, Law, Need, Parity, State, shape, strength
from etb_hil.plant.effects.port import Port

COPPER = 0.00393  # 1/K


def share(housing: float, rise: float, housing_share: float, self_heating: float) -> float:
    """Return what of the resistance is added, a share of it.

    The housing's temperature in degC is as the winding has followed it; the rise is in K.
    """
    return COPPER * (housing_share * (housing - REFERENCE) + self_heating * rise)


def warm(rise: float, current: float, dt: float, self_heating: float, time_constant: float, resistance: float) -> float:
    """Return the winding's rise in K after dt s under a current, at 10 K/W."""
    if self_heating == 0.0:
        return rise
    return lagged(rise, 10.0 * resistance * current * current, dt, time_constant)


def start(temperature: float) -> float:
    """Return the temperature in degC of a winding that has long been there."""
    return temperature


def follow(housing: float, temperature: float, dt: float, housing_share: float, time_constant: float) -> float:
    """Return the housing's temperature in degC as the winding has it after dt s."""
    if housing_share == 0.0:
        return housing
    return lagged(housing, temperature, dt, time_constant)


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
    check="measure the resistance at the plug, cold and hot",
    look_alikes=("supply_sag", "brush_drop", "parameter:resistance"),
    separated_by="hold the motor at two currents, cold and hot",
    source="IEC 60034-1 (copper, 1 / (234.5 + 20) K)",
    terms={Port.RESISTANCE_SHARE: share},
    states=(State("housing", follow, start), State("rise", warm)),
    needs=frozenset({Need.CURRENT}),
    laws=(Law(("resistance",), "housing_share", COPPER, "time_constant"),),
)
