"""About limp-home neither spring pulls: a zone wider than the model's, or shifted."""

from __future__ import annotations

from numba import njit

from etb_hil.plant.effects.effect import Balance, Effect, Parity, shape, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import LIMP_HOME, Vector

_K = row("limp_home_dead_zone")

EFFECT = Effect(
    id="limp_home_dead_zone",
    equation="springs at lh + max(0, abs(x) - w) sgn(x), x = theta - lh - d",
    balance=Balance.TORQUE,
    parity=Parity.EVEN,
    parameters=(
        strength("half_width", "rad", -0.001, 0.08, (0.002, 0.008, 0.02), "wear of the limp-home lever"),
        shape("shift", "rad", -0.06, 0.06, (-0.008, 0.0, 0.008), "of the zone's middle"),
        shape("softness", "1", 0.0, 1.0, (0.8, 0.0), "0: nothing pulls inside; 1: torque rises evenly over the zone"),
    ),
    looks_like="the plate is loose over some degrees about limp-home",
    check="lever and stop of the limp-home position",
    look_alikes=("gear_backlash", "parameter:limp_home", "parameter:dead_zone", "end_stop_compliance"),
    separated_by="+-3 deg about limp-home, quasi-static",
    source="seed paper, fig. 3 (dead zone)",
)


@njit(cache=True, error_model="numpy")
def moved(theta: float, p: Vector) -> float:
    """Return the angle in rad at which the base model's springs give the torque that these give at an angle."""
    if p[_K] == 0.0:
        return theta
    x = theta - p[LIMP_HOME] - p[_K + 1]
    width = p[_K]
    if abs(x) >= abs(width):
        return p[LIMP_HOME] + (x - width if x > 0.0 else x + width)
    return p[LIMP_HOME] if width > 0.0 else p[LIMP_HOME] - x


@njit(cache=True, error_model="numpy")
def softened(theta: float, torque: float, full: float, p: Vector) -> float:
    """Return the springs' torque in N·m where it rises over the zone; `full`: what they give just outside it."""
    if p[_K] <= 0.0 or p[_K + 2] == 0.0:
        return torque
    x = theta - p[LIMP_HOME] - p[_K + 1]
    if abs(x) >= p[_K]:
        return torque
    return torque + p[_K + 2] * (full * x / p[_K] - torque)
