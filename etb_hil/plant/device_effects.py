"""The catalogue of effects with the bounds that a device's friction has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from etb_hil.plant.drive_effects import THROTTLE_FRICTION
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.effect import Effect, EffectParameter
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector


def largest_torque(model: Model, voltage: Vector) -> float:
    """Return the largest torque in N·m that a voltage (n, V) makes at rest."""
    v = model.values
    return v.torque_per_ampere / v.resistance * float(np.abs(voltage).max())


def effects_of(model: Model, largest: float = 0.0) -> dict[str, Effect]:
    """Return all effects by id; a drive's torques are to its friction as a throttle's.

    They may be as large as the `largest` torque that drove it, in N·m. What comes a whole number of times in a motor's
    turn does not in a drive's.
    """
    if model.device.is_throttle:
        return dict(CATALOGUE)
    load = model.values.coulomb / THROTTLE_FRICTION
    return {id_: _scaled(effect, load, largest) for id_, effect in CATALOGUE.items()}


def _scaled(effect: Effect, load: float, largest: float) -> Effect:
    own, finer = (tuple(_parameter(one, load, largest) for one in part) for part in (effect.parameters, effect.finer))
    return replace(effect, parameters=own, finer=finer)


def _parameter(one: EffectParameter, load: float, largest: float) -> EffectParameter:
    if one.unit != "N·m":
        return replace(one, is_count=False)  # a drive's turn is not its motor's
    starts, elsewhere = (tuple(load * value for value in part) for part in (one.starts, one.elsewhere))
    low, high = within(one, load, largest)
    return replace(one, low=low, high=high, scale=load * one.scale, starts=starts, elsewhere=elsewhere)


def within(one: EffectParameter, load: float, largest: float) -> tuple[float, float]:
    """Return the bounds of a torque of a drive, see `effects_of`.

    `load` is its friction over a throttle's.
    """
    low, high = load * one.low, load * one.high
    if not one.is_strength:
        return low, high
    return min(low, -largest) if low < 0.0 else low, max(high, largest)
