"""Candidates for effects that a model lacks.

These are effects in their shapes, and base parameters beyond their tolerances.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from etb_hil.estimation.filtering import Column
from etb_hil.estimation.kalman import STEP_MOTOR, STEP_PLATE
from etb_hil.estimation.record import Record
from etb_hil.estimation.unknown import Unknown
from etb_hil.hypotheses.constants import BEYOND, LOCAL
from etb_hil.plant.effects.effect import Effect, EffectParameter, Need
from etb_hil.recording.samples import Float64

_STILL = 1e-9  # rad: a plate that moves less rests
CHANGES = 1.0  # K: a temperature that stays within it tells nothing of heat


@dataclass(frozen=True, slots=True)
class Candidate:
    """An effect in one shape, its strengths 0 or as a law of the model file says.

    `turn`: which start of each strength its effect is evaluated at. At a small size a wide zone shows nothing.
    """

    effect: Effect
    parameters: Float64
    turn: int = 0

    @property
    def id(self) -> str:
        """The id of the effect."""
        return self.effect.id

    def columns(self) -> list[Column]:
        """Return the columns of the strengths that a search tries."""
        found = []
        for k in self.effect.searched:
            starts = self.effect.parameters[k].starts
            place, step = self.effect.indices[k], starts[min(self.turn, len(starts) - 1)]
            found.append(Column(self.effect.id, step, place, self.effect, parameters=self.parameters))
        return found

    def unknowns(self) -> list[Unknown]:
        """Return those strengths; each prior is as wide as a uniform law in its bounds."""
        found = []
        for k in self.effect.searched:
            place = self.effect.indices[k]
            stated = self.effect.stated[place - self.effect.stated_indices[0]]
            there = float(self.parameters[place])
            found.append(Unknown(self.effect.id, place, there, _width(stated), low=stated.low, high=stated.high))
        return found

    def at(self, steps: Float64) -> Float64:
        """Return the whole vector with its strengths moved by steps, inside their bounds."""
        p = self.parameters.copy()
        for one, step in zip(self.unknowns(), steps, strict=True):
            p[one.place] = np.clip(p[one.place] + step, one.low, one.high)
        return p


@dataclass(frozen=True, slots=True)
class FittedEffect(Candidate):
    """An effect in one shape with all of its strengths.

    A search tries some of them.
    """

    def columns(self) -> list[Column]:
        """Return the columns of all strengths."""
        return [replace(one.column(), parameters=self.parameters) for one in self.unknowns()]

    def unknowns(self) -> list[Unknown]:
        """Return all strengths, within their bounds."""
        acting = set(self.effect.acting_indices)
        return [one for one in unknowns_of(self.effect, self.parameters) if one.place in acting]


def can_show(record: Record, effect: Effect) -> bool:
    """Return whether a record has what it takes to tell an effect."""
    current, motor, plate = (bool(np.isfinite(one).any()) for one in record.readings.T)
    shows = {
        Need.BOTH_WAYS: record.goes_both_ways,
        Need.CURRENT: current,
        Need.DRIVING: current or record.is_read,
        Need.MOTOR_ANGLE: motor,
        Need.PLATE_ANGLE: plate,
        Need.TEMPERATURE: bool(np.ptp(record.temperature) > CHANGES),
    }
    return all(shows.get(need, True) for need in effect.needs)


def as_seen(record: Record, effects: Mapping[str, Effect], gear_ratio: float) -> dict[str, Effect]:
    """Return effects with possible strengths, and with shapes that a record shows.

    A wave of which less than a period is seen is any curve, and so is a bump as wide as the range. What is narrower
    than a step of the angle is not seen. Effects of which no shape is seen are left out.
    """
    _, motor, plate = record.readings.T
    angle = motor if np.isfinite(motor).any() else plate
    seen = max(float(np.nanmax(angle) - np.nanmin(angle)), _STILL)
    period, width = 2.0 * math.pi / (gear_ratio * seen), LOCAL * seen
    step = float(record.settings[STEP_MOTOR if angle is motor else STEP_PLATE])

    def possible(effect: Effect, one: EffectParameter) -> EffectParameter:
        if one.is_strength:
            return replace(one, low=max(one.low, 0.0)) if effect.is_one_way else one
        low = max(one.low, period) if one.unit == "1/turn" else max(one.low, step) if one.is_width else one.low
        high = min(one.high, width) if one.is_width else one.high
        return replace(one, low=low, high=high, starts=tuple(dict.fromkeys(np.clip(one.starts, low, high).tolist())))

    found = {
        id_: replace(effect, parameters=tuple(possible(effect, one) for one in effect.parameters))
        for id_, effect in effects.items()
    }
    return {id_: effect for id_, effect in found.items() if all(one.low < one.high for one in effect.parameters)}


def candidates(record: Record, parameters: Float64, effects: Iterable[Effect]) -> list[Candidate]:
    """Return the effects that a record can show beside some parameters.

    Each comes in all shapes of its grid, and at all starts of its strengths.
    """
    found = []
    for effect in effects:
        if not can_show(record, effect):
            continue
        there = parameters[list(effect.stated_indices)]
        grids = [(value,) if one.is_strength else one.starts for one, value in zip(effect.stated, there, strict=True)]
        for values in product(*grids):
            p = parameters.copy()
            p[list(effect.stated_indices)] = values
            turns = max(len(effect.parameters[k].starts) for k in effect.searched)
            found += [Candidate(effect, p, turn) for turn in range(turns)]
    return found


def unknowns_of(effect: Effect, parameters: Float64) -> list[Unknown]:
    """Return all that is fitted of an effect, within its bounds.

    Strengths are fitted about 0, shapes about where they stand. A number of slots or poles is what it is, or near its
    start where a drive's turn may not be its motor's. A further wave with an order of 0 is not there.
    """
    found = []
    for one, place in zip(effect.stated, effect.stated_indices, strict=True):
        if one.is_count or (one.under and parameters[effect.place(one.under)] == 0.0):
            continue
        mean = 0.0 if one.is_strength else float(parameters[place])
        is_near = one in effect.finer or any(other.under for other in effect.finer)
        deviation = one.scale if is_near and one.scale and not (one.under and one.is_strength) else _width(one)
        name = f"{effect.id}.{one.name}"
        found.append(Unknown(name, place, mean, deviation, effect=effect, low=one.low, high=one.high))
    return found


def freed(unknowns: Sequence[Unknown], names: Sequence[str]) -> list[Unknown]:
    """Return unknowns of which some may leave their tolerances."""
    return [replace(one, deviation=BEYOND * one.reach, reach=np.inf) if one.name in names else one for one in unknowns]


def _width(stated: EffectParameter) -> float:
    return (stated.high - stated.low) / math.sqrt(12.0)
