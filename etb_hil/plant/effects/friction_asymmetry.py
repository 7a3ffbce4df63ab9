"""Friction that differs by direction."""

from __future__ import annotations

from etb_hil.plant.effects.curves import side
from etb_hil.plant.effects.effect import Balance, Effect, Need, Parity, finer, shape, strength
from etb_hil.plant.effects.port import Port


def share(
    omega: float,
    surplus: float,
    friction: float,
    fade: float,
    one_sided: float,
    lag: float,
    evenness: float,
    stribeck_velocity: float,
) -> float:
    """Return what of the friction is added at a velocity, a share of it.

    `surplus` is the share beyond Coulomb's.
    """
    if friction == 0.0:
        return 0.0
    settled = side(omega / (fade * stribeck_velocity), lag)
    return friction * (settled + one_sided) * (1.0 - evenness * surplus)


def viscous_share(omega: float, viscosity: float, fade: float, lag: float, stribeck_velocity: float) -> float:
    """Return what of the viscosity is added at a velocity, a share of it."""
    return viscosity * side(omega / (fade * stribeck_velocity), lag) if viscosity != 0.0 else 0.0


EFFECT = Effect(
    id="friction_asymmetry",
    equation=(
        "(T_c + (1 - d) (g - T_c)) a (s + o) added to g, sigma_2 (1 + b s); "
        "s = tanh(x), at c = 1 x / (1 + |x|), at c = -1 min(1, max(-1, x)); x = omega / (f omega_s)"
    ),
    balance=Balance.TORQUE,
    parity=Parity.EVEN,
    parameters=(
        strength("friction", "1", -0.7, 0.7, (0.05,), "chosen bounds; emps shows 1 %"),
        strength("viscosity", "1", -0.9, 0.9, (0.2,), "chosen bounds; emps shows 18 %"),
        shape("fade", "1", 0.001, 0.15, (0.006, 0.04), "where the direction is settled, in shares of omega_s"),
        shape(
            "one_sided",
            "1",
            -1.0,
            1.0,
            (-1.0, 0.0, 1.0),
            "o: 0 the other side loses as much, 1 it keeps its own",
            0.1,
        ),
    ),
    looks_like="one direction needs more torque than the other, also where the load turns round",
    check="read the current sensor's zero, then look for a one-sided seal or brush",
    look_alikes=("spring_preload_shift", "current_sensor_offset"),
    separated_by="sweep through limp-home, and read the current's zero with the bridge off",
    source="Janot, Gautier, Brunot 2019 (asymmetric friction of a drive); Armstrong-Helouvry 1991 (sides settle apart)",
    finer=(
        finer("lag", "1", -1.0, 1.3, "c: 0 the side is settled as tanh, 1 as x / (1 + |x|), -1 along a line", 0.25),
        finer("evenness", "1", -0.5, 1.5, "d: 1 the break-away's surplus is equal on both sides", 0.25),
    ),
    terms={Port.FRICTION_SHARE: share, Port.VISCOUS_SHARE: viscous_share},
    needs=frozenset({Need.BOTH_WAYS}),
    separated_on_drive="mount the axis the other way round: its friction turns with it, a load does not",
)
