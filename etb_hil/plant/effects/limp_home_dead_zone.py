"""About limp-home neither spring pulls: a zone wider than the model's, or shifted."""

from __future__ import annotations

from etb_hil.plant.effects.effect import Balance, Effect, Need, Parity, shape, strength
from etb_hil.plant.effects.port import Port

_WEAR = "wear of the limp-home lever"
_NARROWEST = 1e-5  # rad
_WIDTHS = (0.01, 0.04, 0.1)  # rad: no slope leads to a zone that is far wider


def springs(
    theta: float,
    above: float,
    below: float,
    softness: float,
    limp_home: float,
    dead_zone: float,
    preload_open: float,
    slope_open: float,
    preload_close: float,
    slope_close: float,
) -> float:
    """Return the springs' torque in N·m at an angle in rad, with this zone.

    The torque is positive where it closes the plate.
    """
    x = theta - limp_home
    distance = abs(x)
    wider = above if x > 0.0 else below
    torque = preload_open + slope_open * distance if x > 0.0 else preload_close + slope_close * distance
    whole = max(dead_zone + wider, _NARROWEST)
    if distance < whole:
        dead = (1.0 - softness) * max(wider, 0.0)
        u = max((distance - dead) / (whole - dead), 0.0)
        torque *= u * u * (3.0 - 2.0 * u)
    return torque if x > 0.0 else -torque


EFFECT = Effect(
    id="limp_home_dead_zone",
    name="limp-home dead zone",
    equation="springs times 3 u^2 - 2 u^3, u = (abs(x) - (1 - s) w) / (dead zone + s w), x = theta - lh; w by side",
    balance=Balance.TORQUE,
    parity=Parity.EVEN,
    parameters=(
        strength("above", "rad", -0.001, 0.12, (0.002, 0.008, 0.02), _WEAR, elsewhere=_WIDTHS),
        strength("below", "rad", -0.001, 0.12, (0.002, 0.008, 0.02), _WEAR, elsewhere=_WIDTHS),
        shape("softness", "1", 0.0, 1.0, (0.8, 0.0), "0: nothing pulls inside; 1: torque rises over the whole zone"),
    ),
    looks_like="the plate is loose over some degrees about limp-home",
    check="inspect lever and stop of the limp-home position",
    look_alikes=("gear_backlash", "parameter:limp_home", "parameter:dead_zone", "end_stop_compliance"),
    separated_by="move slowly within 3 deg about limp-home",
    source="seed paper, fig. 3 (dead zone)",
    is_of_place=True,
    terms={Port.SPRINGS: springs},
    needs=frozenset({Need.THROTTLE}),
)
