"""Friction that grows with the torque that the teeth carry."""

from __future__ import annotations

from etb_hil.plant.effects.effect import Balance, Effect, Need, Parity, finer, shape, strength
from etb_hil.plant.effects.port import Port


def torque(
    load: float, bristle_torque: float, coefficient: float, exponent: float, friction_share: float, threshold: float
) -> float:
    """Return the friction level in N·m that a load adds.

    Load and friction are signed, in N·m.
    """
    if coefficient == 0.0:
        return 0.0
    carried = max(abs(load + friction_share * bristle_torque) - threshold, 0.0)
    return coefficient * (carried + 1e-12) ** exponent


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
    check="inspect the gear teeth for wear and lubrication",
    look_alikes=("friction_asymmetry", "current_sensor_gain", "friction_position_local"),
    separated_by="repeat the record with another load at the same angle",
    source="Bittencourt and Gunnarsson 2012; servo gearbox data sheets",
    finer=(finer("threshold", "N·m", 0.0, 0.3, "tau_0: a load that the teeth's film still carries", 0.05),),
    is_one_way=True,
    terms={Port.FRICTION_TORQUE: torque},
    needs=frozenset({Need.SPRING}),
)
