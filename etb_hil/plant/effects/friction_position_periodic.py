"""Friction that comes and goes with the turning of a shaft."""

from __future__ import annotations

from etb_hil.plant.effects.curves import wave
from etb_hil.plant.effects.effect import Balance, Effect, Parity, finer, shape, strength
from etb_hil.plant.effects.port import Port

_SPAN = "bearings and teeth: 2 to 10 % of T_c (Armstrong-Helouvry 1991)"


def share(
    theta: float,
    surplus: float,
    sine: float,
    cosine: float,
    order: float,
    second_sine: float,
    second_cosine: float,
    pointedness: float,
    evenness: float,
    gear_ratio: float,
) -> float:
    """Return what of the friction is added at an angle, a share of it.

    `surplus` is the share beyond Coulomb's.
    """
    if sine == 0.0 and cosine == 0.0:
        return 0.0
    phase = order * gear_ratio * theta
    return wave(phase, sine, cosine, pointedness, second_sine, second_cosine) * (1.0 - evenness * surplus)


EFFECT = Effect(
    id="friction_position_periodic",
    equation=(
        "g + (T_c + (1 - e) (g - T_c)) (a sin(n N theta) + b cos(n N theta) + c sin(2 n N theta) + d cos(2 n N theta));"
        " the first wave w = A sin(x) becomes A asin(sqrt(p) sin(x)) / asin(sqrt(p))"
    ),
    balance=Balance.TORQUE,
    parity=Parity.ODD,
    parameters=(
        strength("sine", "1", -0.8, 0.8, (0.05,), _SPAN),
        strength("cosine", "1", -0.8, 0.8, (0.05,), _SPAN),
        shape(
            "order", "1/turn", 0.18, 4.0, (*(0.2 + 0.09 * k for k in range(36)), 1.0, 2.0, 3.0), "per motor turn", 0.02
        ),
        strength("second_sine", "1", -0.8, 0.8, (), "at twice the order"),
        strength("second_cosine", "1", -0.8, 0.8, (), "at twice the order"),
    ),
    looks_like="friction wavy over the angle, equal in both directions",
    check="inspect bearings, gear teeth and shaft; turn by hand and feel for periodic drag",
    look_alikes=("cogging_torque", "angle_sensor_eccentricity", "friction_position_local"),
    separated_by="record at two speeds in both directions, and compare the orders: friction changes its sign",
    source="Armstrong-Helouvry, Control of Machines with Friction, 1991",
    is_of_place=True,
    finer=(
        finer("pointedness", "1", -4.0, 1.0, "p: 1 makes a triangle of the first wave, below 0 it is flat", 0.25),
        finer("evenness", "1", -0.5, 1.5, "e: 1 the break-away's surplus is equal all over the turn", 0.25),
    ),
    terms={Port.FRICTION_SHARE: share},
)
