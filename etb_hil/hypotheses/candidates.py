"""Candidates for effects that a model lacks.

These are effects in their shapes, and base parameters beyond their tolerances.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from etb_hil.estimation.filtering import Column
from etb_hil.estimation.forces import INDEX
from etb_hil.estimation.record import Record
from etb_hil.estimation.unknown import Unknown
from etb_hil.hypotheses.constants import BEYOND
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.effect import Effect, EffectParameter, Need
from etb_hil.recording.samples import Float64

CHANGES = 1.0  # K: a temperature that stays within it tells nothing of heat


@dataclass(frozen=True, slots=True)
class Candidate:
    """An effect in one shape: `parameters` has its shapes, its strengths being 0."""

    effect: Effect
    parameters: Float64

    def columns(self) -> list[Column]:
        """Return the columns of the strengths that a search tries."""
        found = []
        for k in self.effect.searched:
            place, step = self.effect.indices[k], self.effect.parameters[k].starts[0]
            found.append(Column(self.effect.id, step, place, self.effect, parameters=self.parameters))
        return found

    def width(self, place: int) -> float:
        """Return the standard deviation of a uniform law between a strength's bounds."""
        stated = self.effect.stated[place - self.effect.stated_indices[0]]
        return _width(stated)

    def at(self, places: Sequence[int], strengths: Float64) -> Float64:
        """Return the whole vector with strengths at their places, inside their bounds."""
        p = self.parameters.copy()
        for place, value in zip(places, strengths, strict=True):
            stated = self.effect.stated[place - self.effect.stated_indices[0]]
            p[place] = np.clip(value, stated.low, stated.high)
        return p


def is_in_filter(id_: str) -> bool:
    """Tell whether the filter has an effect compiled.

    Those of plug-ins it has not; what is no effect it has.
    """
    return id_ not in CATALOGUE or id_ in INDEX


def can_show(record: Record, effect: Effect) -> bool:
    """Return whether a record has what it takes to tell an effect."""
    current, motor, plate = (bool(np.isfinite(one).any()) for one in record.readings.T)
    shows = {
        Need.CURRENT: current,
        Need.MOTOR_ANGLE: motor,
        Need.PLATE_ANGLE: plate and motor,
        Need.TEMPERATURE: bool(np.ptp(record.temperature) > CHANGES),
    }
    return all(shows.get(need, True) for need in effect.needs)


def candidates(record: Record, parameters: Float64, ids: Iterable[str]) -> list[Candidate]:
    """Return the effects that a record can show beside some parameters.

    Each comes in all shapes of its grid.
    """
    found = []
    for effect in (CATALOGUE[id_] for id_ in ids):
        has_it = any(parameters[effect.indices[k]] != 0.0 for k in effect.strengths)
        if has_it or not is_in_filter(effect.id) or not can_show(record, effect):
            continue
        grids = [(0.0,) if one.is_strength else one.starts for one in effect.stated]
        for values in product(*grids):
            p = parameters.copy()
            p[list(effect.stated_indices)] = values
            found.append(Candidate(effect, p))
    return found


def unknowns_of(effect: Effect, parameters: Float64) -> list[Unknown]:
    """Return all that is fitted of an effect, within its bounds.

    Strengths are fitted about 0, shapes about where they stand.
    """
    found = []
    for one, place in zip(effect.stated, effect.stated_indices, strict=True):
        mean = 0.0 if one.is_strength else float(parameters[place])
        deviation = one.scale if one in effect.finer and one.scale else _width(one)
        name = f"{effect.id}.{one.name}"
        found.append(Unknown(name, place, mean, deviation, effect=effect, low=one.low, high=one.high))
    return found


def freed(unknowns: Sequence[Unknown], names: Sequence[str]) -> list[Unknown]:
    """Return unknowns of which some may leave their tolerances."""
    return [replace(one, deviation=BEYOND * one.reach, reach=np.inf) if one.name in names else one for one in unknowns]


def _width(stated: EffectParameter) -> float:
    return (stated.high - stated.low) / math.sqrt(12.0)
