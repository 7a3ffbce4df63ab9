"""Friction that differs by direction."""

from __future__ import annotations

import math

from numba import njit

from etb_hil.plant.effects.effect import Balance, Effect, Parity, shape, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import STRIBECK_VELOCITY, Vector

_K = row("friction_asymmetry")

EFFECT = Effect(
    id="friction_asymmetry",
    equation="g (1 + a tanh(omega / (f omega_s))), sigma_2 (1 + b tanh(omega / (f omega_s)))",
    balance=Balance.TORQUE,
    parity=Parity.EVEN,
    parameters=(
        strength("friction", "1", -0.7, 0.7, (0.05,), "chosen bounds; emps shows 1 %"),
        strength("viscosity", "1", -0.9, 0.9, (0.2,), "chosen bounds; emps shows 18 %"),
        shape("fade", "1", 0.001, 0.15, (0.006, 0.04), "where the direction is settled, in shares of omega_s"),
    ),
    looks_like="opening and closing need different torque, also where the spring turns round",
    check="one-sided seal or brush; current sensor's zero first",
    look_alikes=("spring_preload_shift", "current_sensor_offset"),
    separated_by="a sweep through limp-home, and the current's zero with the bridge off",
    source="Janot, Gautier, Brunot 2019 (asymmetric friction of a drive)",
)


@njit(cache=True, error_model="numpy")
def share(omega: float, p: Vector) -> float:
    """Return what of the friction is added at a velocity, a share of it."""
    return p[_K] * math.tanh(omega / (p[_K + 2] * p[STRIBECK_VELOCITY])) if p[_K] != 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def viscous_share(omega: float, p: Vector) -> float:
    """Return what of the viscosity is added at a velocity, a share of it."""
    return p[_K + 1] * math.tanh(omega / (p[_K + 2] * p[STRIBECK_VELOCITY])) if p[_K + 1] != 0.0 else 0.0
