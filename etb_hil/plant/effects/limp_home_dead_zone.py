"""About limp-home neither spring pulls: a zone wider than the model's, or shifted."""

from __future__ import annotations

from numba import njit

from etb_hil.plant.effects.effect import Balance, Effect, Parity, shape, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import (
    DEAD_ZONE,
    LIMP_HOME,
    PRELOAD_CLOSE,
    PRELOAD_OPEN,
    SLOPE_CLOSE,
    SLOPE_OPEN,
    Vector,
)

_K = row("limp_home_dead_zone")
_WEAR = "wear of the limp-home lever"
_NARROWEST = 1e-5  # rad

EFFECT = Effect(
    id="limp_home_dead_zone",
    equation="springs times 3 u^2 - 2 u^3, u = (abs(x) - (1 - s) w) / (dead zone + s w), x = theta - lh; w by side",
    balance=Balance.TORQUE,
    parity=Parity.EVEN,
    parameters=(
        strength("above", "rad", -0.001, 0.12, (0.002, 0.008, 0.02), _WEAR),
        strength("below", "rad", -0.001, 0.12, (0.002, 0.008, 0.02), _WEAR),
        shape("softness", "1", 0.0, 1.0, (0.8, 0.0), "0: nothing pulls inside; 1: torque rises over the whole zone"),
    ),
    looks_like="the plate is loose over some degrees about limp-home",
    check="lever and stop of the limp-home position",
    look_alikes=("gear_backlash", "parameter:limp_home", "parameter:dead_zone", "end_stop_compliance"),
    separated_by="+-3 deg about limp-home, quasi-static",
    source="seed paper, fig. 3 (dead zone)",
    is_of_place=True,
)


@njit(cache=True, error_model="numpy")
def is_there(p: Vector) -> bool:
    """Tell whether the zone is another than the base model's."""
    return p[_K] != 0.0 or p[_K + 1] != 0.0


@njit(cache=True, error_model="numpy")
def spring_torque(theta: float, p: Vector) -> float:
    """Return the springs' torque in N·m at an angle in rad, positive where it closes the plate, with this zone."""
    x = theta - p[LIMP_HOME]
    distance = abs(x)
    wider = p[_K] if x > 0.0 else p[_K + 1]
    torque = p[PRELOAD_OPEN] + p[SLOPE_OPEN] * distance if x > 0.0 else p[PRELOAD_CLOSE] + p[SLOPE_CLOSE] * distance
    whole = max(p[DEAD_ZONE] + wider, _NARROWEST)
    if distance < whole:
        dead = (1.0 - p[_K + 2]) * max(wider, 0.0)
        u = max((distance - dead) / (whole - dead), 0.0)
        torque *= u * u * (3.0 - 2.0 * u)
    return torque if x > 0.0 else -torque
