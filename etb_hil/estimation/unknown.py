"""Unknowns of a fit: base parameters, and those of effects.

Base parameters lie about what the model file states.

Every constant of the model is free with a prior; none is believed exact: with a few of them off by 3 % and held fixed,
healthy records show false causes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from etb_hil.estimation.filtering import Column
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import BACK_EMF, TORQUE_PER_AMPERE
from etb_hil.plant.values import ThrottleParameters
from etb_hil.recording.samples import Float64

_STEP = 0.01  # of a standard deviation: step of the differences
_EXACT = ("gear_ratio", "supply_voltage", "voltage_limit", "back_emf")  # teeth are counted; K_e moves with K_t
# Of a drive: a constant load acts either way, and positions are counted from anywhere.
_EITHER_WAY = ("preload_open", "limp_home", "stop_low", "stop_high")


@dataclass(frozen=True, slots=True)
class Unknown:
    """A parameter that is fitted.

    An unknown has a place in the vector; its prior has a mean and a standard deviation.

    `reach`: how far it may be off before the wall begins, infinite for none. `tied`: what moves along in proportion.
    `low` and `high`: what it never leaves. `term`: the number of the record's term that it is the size of, -1 for none.
    """

    name: str
    place: int
    mean: float
    deviation: float
    reach: float = np.inf
    effect: Effect | None = None
    tied: int = -1
    low: float = -np.inf
    high: float = np.inf
    term: int = -1

    def column(self) -> Column:
        """Return what the sensitivities are asked of, in units of the parameter."""
        if self.term >= 0:
            return Column(self.name, 1.0, term=self.term)
        return Column(self.name, _STEP * self.deviation, self.place, self.effect, tied=self.tied)

    def put(self, parameters: Float64, value: float) -> None:
        """Set the parameter in a vector, in place, and what is tied to it."""
        if self.tied >= 0:
            parameters[self.tied] *= value / parameters[self.place]
        parameters[self.place] = value


def as_stated(parameters: Float64, unknowns: Sequence[Unknown]) -> Float64:
    """Return parameters with the base model's as they are stated.

    A fit may have hidden a cause in them.
    """
    found = parameters.copy()
    for one in unknowns:
        if one.effect is None and np.isfinite(one.reach):
            one.put(found, one.mean)
    return found


def base_unknowns(model: Model) -> list[Unknown]:
    """Return the base parameters that have a tolerance.

    Each is uniform within it, by its first two moments.
    """
    either_way = () if model.device.is_throttle else _EITHER_WAY
    found = []
    for place, one in enumerate(fields(ThrottleParameters)):
        half = model.tolerance(one.name) if one.name not in _EXACT else 0.0
        if half > 0.0:
            mean = getattr(model.values, one.name)
            tied = BACK_EMF if place == TORQUE_PER_AMPERE else -1
            low = 0.05 * mean if mean > 0.0 and one.name not in either_way else -np.inf
            found.append(Unknown(one.name, place, mean, half / np.sqrt(3.0), half, tied=tied, low=low))
    return found
