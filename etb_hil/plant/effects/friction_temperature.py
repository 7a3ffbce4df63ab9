"""Friction that changes with the housing's temperature."""

from __future__ import annotations

import math

from etb_hil.plant.effects.effect import REFERENCE, Balance, Effect, Law, Need, Parity, finer, strength
from etb_hil.plant.effects.port import Port

PER = 30.0  # K
COLDEST = -65.0  # degC, which no throttle sees
_EXPONENTIAL = 1e-4  # a power below it is none


def share(temperature: float, friction_per_30_kelvin: float, curve: float, cold_limit: float) -> float:
    """Return what of the friction is added at a temperature in degC, a share of it."""
    # What falls in the cold and levels off there is no film: use does that.
    felt = max(temperature, COLDEST + cold_limit) if friction_per_30_kelvin < 0.0 else temperature
    along = friction_per_30_kelvin * (felt - REFERENCE) / PER
    power = 1.0 + curve
    if power == 1.0:
        return along
    if abs(power) < _EXPONENTIAL:
        return math.exp(along) - 1.0
    inside = 1.0 + power * along
    return inside ** (1.0 / power) - 1.0 if inside > 0.0 else (-1.0 if power > 0.0 else 0.0)


def viscous_share(temperature: float, viscosity_per_30_kelvin: float) -> float:
    """Return what of the viscosity is added at a temperature in degC, a share of it."""
    if viscosity_per_30_kelvin == 0.0:
        return 0.0
    return math.exp(viscosity_per_30_kelvin * (temperature - REFERENCE) / PER) - 1.0


EFFECT = Effect(
    id="friction_temperature",
    equation=(
        "g, with all else that changes it, (1 + (1 + c) a x)^(1 / (1 + c)), in which T, where a < 0, is no less than "
        "-65 degC + e; sigma_2 exp(b x); x = (T - 25 degC) / 30 K"
    ),
    balance=Balance.TORQUE,
    parity=Parity.ODD,
    parameters=(
        strength("friction_per_30_kelvin", "1", -0.9, 1.5, (-0.1,), "moves friction more than wear does"),
        strength("viscosity_per_30_kelvin", "1", -3.0, 3.0, (-0.3,), "grease thins when warm"),
    ),
    looks_like="friction drifts as the housing warms or cools",
    check="check the grease; repeat the record cold and warm",
    look_alikes=("magnet_temperature",),
    separated_by="log the temperature, and repeat the record at the first one",
    source="Bittencourt and Gunnarsson 2012 (friction over temperature)",
    limits="needs the temperature logged, and changing",
    finer=(
        finer("curve", "1", -2.2, 0.2, "c: 0 falls in proportion, -1 exponentially, -2 as 1 / (1 + x)", 0.5),
        finer(
            "cold_limit",
            "K",
            0.0,
            90.0,
            "e: no film bears more than its limiting shear stress, however stiff the cold makes it (Bair, Winer 1979)",
            10.0,
            (80.0, 70.0, 60.0, 50.0, 40.0),
        ),
    ),
    terms={Port.FRICTION_HEAT: share, Port.VISCOUS_SHARE: viscous_share},
    needs=frozenset({Need.TEMPERATURE}),
    laws=(Law(("coulomb", "stiction", "viscous"), "friction_per_30_kelvin", 1.0 / PER),),
)
