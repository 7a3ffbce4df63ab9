"""Friction that grows with the torque that the teeth carry."""

from __future__ import annotations

from numba import njit

from etb_hil.plant.effects.effect import Balance, Effect, Parity, finer, shape, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import Vector

_K = row("friction_load")

EFFECT = Effect(
    id="friction_load",
    equation="g + mu max(0, |tau| - tau_0)^n, tau of springs, stops and plate inertia, and a share of friction",
    balance=Balance.TORQUE,
    parity=Parity.ODD,
    parameters=(
        strength("coefficient", "1", -0.1, 0.6, (0.05,), "0.11 to 0.22 of the torque in servos"),
        shape("exponent", "1", 0.5, 2.0, (1.0,), "1: Coulomb's law"),
        shape("friction_share", "1", 0.0, 1.0, (0.5,), "where along the gear the friction sits"),
    ),
    looks_like="friction is higher where the spring pulls harder, and on the stops",
    check="lubrication and wear of the teeth",
    look_alikes=("friction_asymmetry", "current_sensor_gain", "friction_position_local"),
    separated_by="another load at the same angle",
    source="Bittencourt and Gunnarsson 2012; servo gearbox data sheets",
    finer=(finer("threshold", "N·m", 0.0, 0.3, "tau_0: a load that the teeth's film still carries", 0.05),),
    is_one_way=True,
)


@njit(cache=True, error_model="numpy")
def torque(load: float, friction: float, p: Vector) -> float:
    """Return the friction level in N·m that is added under a load and a friction, both signed, in N·m."""
    if p[_K] == 0.0:
        return 0.0
    carried = max(abs(load + p[_K + 2] * friction) - p[_K + 3], 0.0)
    return p[_K] * (carried + 1e-12) ** p[_K + 1]
