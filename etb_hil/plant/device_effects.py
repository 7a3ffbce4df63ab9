"""The catalogue of effects with the bounds that a device's friction has."""

from __future__ import annotations

from dataclasses import replace

from etb_hil.plant.drive_effects import THROTTLE_FRICTION
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.effect import Effect, EffectParameter
from etb_hil.plant.parameters import Model


def effects_of(model: Model) -> dict[str, Effect]:
    """Return all effects by id; a drive's torques are to its friction as a throttle's.

    What comes a whole number of times in a motor's turn does not in a drive's.
    """
    if model.device.is_throttle:
        return dict(CATALOGUE)
    load = model.values.coulomb / THROTTLE_FRICTION
    return {id_: _scaled(effect, load) for id_, effect in CATALOGUE.items()}


def _scaled(effect: Effect, load: float) -> Effect:
    own, finer = (tuple(_parameter(one, load) for one in part) for part in (effect.parameters, effect.finer))
    return replace(effect, parameters=own, finer=finer)


def _parameter(one: EffectParameter, load: float) -> EffectParameter:
    if one.unit != "N·m":
        return replace(one, is_count=False)  # a drive's turn is not its motor's
    starts, elsewhere = (tuple(load * value for value in part) for part in (one.starts, one.elsewhere))
    return replace(
        one, low=load * one.low, high=load * one.high, scale=load * one.scale, starts=starts, elsewhere=elsewhere
    )
