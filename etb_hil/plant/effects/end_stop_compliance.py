"""Something soft in front of the stops."""

from __future__ import annotations

from etb_hil.plant.effects.effect import Balance, Effect, Need, Parity, shape, strength
from etb_hil.plant.effects.port import Port

_LAYER = "deposits of up to some degrees"


def torque(
    theta: float,
    omega: float,
    upper_stiffness: float,
    lower_stiffness: float,
    upper_layer: float,
    lower_layer: float,
    exponent: float,
    damping: float,
    stop_low: float,
    stop_high: float,
) -> float:
    """Return the torque in N·m at an angle and a velocity.

    The torque is positive where it closes the plate; a layer never pulls.
    """
    if upper_stiffness == 0.0 and lower_stiffness == 0.0:
        return 0.0
    upper = (theta - stop_high) / upper_layer + 1.0
    lower = (stop_low - theta) / lower_layer + 1.0
    found = 0.0
    if upper > 0.0:
        found += upper_stiffness * upper_layer * upper**exponent * max(1.0 + damping * omega, 0.0)
    if lower > 0.0:
        found -= lower_stiffness * lower_layer * lower**exponent * max(1.0 - damping * omega, 0.0)
    return found


EFFECT = Effect(
    id="end_stop_compliance",
    equation="max(0, theta - theta_e)(k + d omega), theta_e a layer before the stop; the same at the lower stop",
    balance=Balance.TORQUE,
    parity=Parity.EVEN,
    parameters=(
        strength("upper_stiffness", "N·m/rad", -20.0, 400.0, (8.0,), "rubber, deposits"),
        strength("lower_stiffness", "N·m/rad", -20.0, 400.0, (8.0,), "rubber, deposits"),
        shape("upper_layer", "rad", 0.001, 0.08, (0.01, 0.03), _LAYER),
        shape("lower_layer", "rad", 0.001, 0.08, (0.01, 0.03), _LAYER),
        shape("exponent", "1", 0.7, 3.0, (1.0,), "1: a spring; more: it stiffens"),
        shape("damping", "s/rad", -0.1, 1.5, (0.0,), "d over k: rubber and deposits yield slowly", 0.1),
    ),
    looks_like="the stop is met early and softly",
    check="look for deposits, a rubber bumper and a loose screw at the stop",
    look_alikes=("shaft_compliance", "gear_backlash", "limp_home_dead_zone", "parameter:stop_stiffness"),
    separated_by="approach each stop at two speeds",
    source="chosen form",
    is_of_place=True,
    is_one_way=True,
    terms={Port.PLATE_TORQUE: torque},
    needs=frozenset({Need.STOPS}),
)
