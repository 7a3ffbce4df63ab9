"""Something soft in front of the stops."""

from __future__ import annotations

from numba import njit

from etb_hil.plant.effects.effect import Balance, Effect, Parity, shape, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import STOP_HIGH, STOP_LOW, Vector

_K = row("end_stop_compliance")
_LAYER = "deposits of up to some degrees"

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
    check="deposits at the closed plate, rubber bumper, loose stop screw",
    look_alikes=("shaft_compliance", "gear_backlash", "limp_home_dead_zone", "parameter:stop_stiffness"),
    separated_by="approach of each stop at two speeds",
    source="chosen form",
    is_of_place=True,
    is_one_way=True,
)


@njit(cache=True, error_model="numpy")
def torque(theta: float, omega: float, p: Vector) -> float:
    """Return the torque in N·m at an angle and a velocity, positive where it closes the plate; a layer never pulls."""
    if p[_K] == 0.0 and p[_K + 1] == 0.0:
        return 0.0
    upper = (theta - p[STOP_HIGH]) / p[_K + 2] + 1.0
    lower = (p[STOP_LOW] - theta) / p[_K + 3] + 1.0
    found = 0.0
    if upper > 0.0:
        found += p[_K] * p[_K + 2] * upper ** p[_K + 4] * max(1.0 + p[_K + 5] * omega, 0.0)
    if lower > 0.0:
        found -= p[_K + 1] * p[_K + 3] * lower ** p[_K + 4] * max(1.0 - p[_K + 5] * omega, 0.0)
    return found
