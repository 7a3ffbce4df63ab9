"""Friction that is higher at one place of the travel."""

from __future__ import annotations

from etb_hil.plant.effects.curves import halved
from etb_hil.plant.effects.effect import Balance, Effect, Parity, finer, shape, strength
from etb_hil.plant.effects.port import Port


def torque(theta: float, peak: float, place: float, width: float, steepness: float, tail: float) -> float:
    """Return the friction level in N·m that is added at an angle."""
    if peak == 0.0:
        return 0.0
    return peak * halved((theta - place) / width, steepness, tail)


EFFECT = Effect(
    id="friction_position_local",
    equation="g + a (1 + (2^t - 1) x^m)^(-1/t), x = |theta - theta_0| / w; t = 0: g + a 2^(-x^m)",
    balance=Balance.TORQUE,
    parity=Parity.ODD,
    parameters=(
        strength("peak", "N·m", -0.1, 0.5, (0.03,), "0.03 to 0.15 N·m; varnish near the closed plate"),
        shape("place", "rad", -0.1, 1.7, tuple(0.02 + 0.11 * k for k in range(14)), "anywhere on the travel"),
        shape(
            "width", "rad", 0.012, 0.2, (0.033, 0.092), "half of it at half its height: a few degrees", is_width=True
        ),
        shape("steepness", "1", 0.8, 5.0, (2.0,), "1 pointed, 2 a bell, more a plateau"),
    ),
    looks_like="it drags at one place, in both directions",
    check="look there for varnish, a scratch and a worn tooth",
    look_alikes=("friction_position_periodic", "friction_load"),
    separated_by="sweep in both directions at two speeds, and compare the residual over angle",
    source="service bulletins on throttle deposits; chosen form",
    is_of_place=True,
    finer=(finer("tail", "1", -1.0, 1.0, "t: -1 ends at a place (m = 1: a triangle), 1 fades slowly", 0.25),),
    terms={Port.FRICTION_TORQUE: torque},
)
