"""Friction that changes with the housing's temperature."""

from __future__ import annotations

from numba import njit

from etb_hil.plant.effects.effect import Balance, Effect, Parity, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import Vector

REFERENCE = 25.0  # degC

_K = row("friction_temperature")

EFFECT = Effect(
    id="friction_temperature",
    equation="g (1 + a (T - 25 degC) / 30 K), sigma_2 (1 + b (T - 25 degC) / 30 K)",
    balance=Balance.TORQUE,
    parity=Parity.ODD,
    parameters=(
        strength("friction_per_30_kelvin", "1", -0.9, 1.5, (-0.1,), "moves friction more than wear does"),
        strength("viscosity_per_30_kelvin", "1", -1.5, 3.0, (-0.3,), "grease thins when warm"),
    ),
    looks_like="friction drifts as the housing warms or cools",
    check="repeat cold and warm; grease",
    look_alikes=("magnet_temperature",),
    separated_by="a logged temperature and a repeat at the first one",
    source="Bittencourt and Gunnarsson 2012 (friction over temperature)",
    limits="needs the temperature logged, and changing",
)


@njit(cache=True, error_model="numpy")
def share(temperature: float, p: Vector) -> float:
    """Return what of the friction is added at a temperature in degC, a share of it."""
    return p[_K] * (temperature - REFERENCE) / 30.0


@njit(cache=True, error_model="numpy")
def viscous_share(temperature: float, p: Vector) -> float:
    """Return what of the viscosity is added at a temperature in degC, a share of it."""
    return p[_K + 1] * (temperature - REFERENCE) / 30.0
