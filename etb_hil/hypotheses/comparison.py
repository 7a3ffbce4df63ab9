"""Compare hypotheses about one record by their evidence.

Each is fitted with disturbances of its own.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.estimation.calibration import settled
from etb_hil.estimation.climbing import Fitted, begun
from etb_hil.estimation.prior import over
from etb_hil.estimation.record import Record
from etb_hil.estimation.unknown import Unknown
from etb_hil.hypotheses.candidates import freed, unknowns_of
from etb_hil.hypotheses.constants import (
    EQUIVALENT_PARAMETER,
    EQUIVALENT_SHAPE,
    GAIN,
    MATERIAL,
    NEEDED,
    NOTHING,
    PARAMETER,
)
from etb_hil.hypotheses.misfit import Misfit, misfit
from etb_hil.hypotheses.terms import BENCH, DRIFT, drift_unknowns
from etb_hil.plant.effects.effect import Effect, Need
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.recording.samples import Float64

# Sliding friction and break-away friction are of the same contacts.
TOGETHER = (("coulomb", "stiction"),)


def are_numbers(ids: Sequence[str]) -> bool:
    """Tell whether a cause is made of base parameters, which have no shape."""
    return ids[0].startswith(PARAMETER)


def least_excluded(ids: Sequence[str], misfit: float, without: float) -> float:
    """Return the part of a misfit above which a cause may exclude another hypothesis.

    `misfit`: all of it with the cause, `without`: that part without it.
    """
    if are_numbers(ids) and misfit < NOTHING:
        return NOTHING  # a shape that a number explains without a residual would be that number's by chance
    return max(MATERIAL, (EQUIVALENT_PARAMETER if are_numbers(ids) else EQUIVALENT_SHAPE) * without)


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """A cause as fitted: an effect, or base parameters out of their tolerances.

    Such parameters leave their tolerances together.

    `evidence` in nats over the calibrated model. `misfit`, `without`: with it and without it.
    """

    ids: tuple[str, ...]
    evidence: float
    misfit: Misfit
    without: Misfit
    fit: Fitted

    @classmethod
    def of(cls, ids: tuple[str, ...], before: Fitted, fit: Fitted) -> Hypothesis:
        """Return the hypothesis that a fit is, beside the calibrated model before it."""
        return cls(ids, fit.evidence - before.evidence, misfit(fit), misfit(before), fit)

    @property
    def effect(self) -> Effect | None:
        """The effect that it is, None where it is none."""
        return next((one.effect for one in self.fit.unknowns if one.effect and one.effect.id in self.ids), None)

    @property
    def is_drift(self) -> bool:
        """Whether it is friction that drifts over time, which has no name."""
        return self.ids == (DRIFT,)

    @property
    def follows_temperature(self) -> bool:
        """Whether it is an effect of a temperature that changes."""
        return self.effect is not None and Need.TEMPERATURE in self.effect.needs

    def added_to(self, parameters: Float64, other: Float64 | None = None) -> Float64:
        """Return a whole vector with the parameters of the cause.

        Where there is another vector, with those that it has in their place.
        """
        found, own = parameters.copy(), self.fit.parameters if other is None else other
        if self.is_drift:
            sizes = slice(EXTENDED + len(BENCH), None)
            found[sizes] = own[sizes]
        if effect := self.effect:
            found[list(effect.stated_indices)] = own[list(effect.stated_indices)]
        for one in self.fit.unknowns:
            if PARAMETER + one.name in self.ids:
                one.put(found, float(own[one.place]))
        return found

    def is_in_tolerance(self, unknowns: Iterable[Unknown]) -> bool:
        """Tell whether the hypothesis consists of base parameters within tolerance.

        Then it is no cause: the model as calibrated was not at its best. `unknowns` are those of that model. Within the
        standard deviation of a tolerance's wall a parameter is not beyond it.
        """
        own = [one for one in unknowns if PARAMETER + one.name in self.ids]
        return bool(own) and bool(np.all(over(self.fit.parameters, own) <= 1.0))

    def excludes(self, other: Hypothesis) -> bool:
        """Tell whether another one is less likely for more than its shape.

        A shape of the catalogue may not quite be the unit's.

        Nats alone do not tell: a shape that is not quite ours costs some. What is excluded has a larger misfit
        than one that the data cannot distinguish from the cause, and the cause removes much of it, in one channel.
        """
        return self.evidence > other.evidence + GAIN and self.misfit.excludes(other.misfit, self.least)

    def excludes_by_far(self, near: Hypothesis) -> bool:
        """Tell whether another one is excluded, and no other start will change that.

        It gains two thirds of this one at most, and would be excluded with two thirds of its misfit, too. `near`: that
        one where its first descent ended.
        """
        is_behind = self.evidence > GAIN and near.evidence < NEEDED * self.evidence - GAIN
        return is_behind and self.misfit.excludes(Misfit(*(NEEDED * one for one in near.misfit)), self.least)

    @property
    def least(self) -> Misfit:
        """What another one has to leave in each part to be excluded."""
        return Misfit(*(least_excluded(self.ids, self.misfit.total, without) for without in self.without))

    def is_idle_beside(self, other: Hypothesis) -> bool:
        """Tell whether it is another one with more in it, which gains nothing."""
        return set(other.ids) < set(self.ids) and self.evidence < other.evidence + GAIN


def fitted(record: Record, before: Fitted, cause: Hypothesis, effects: Mapping[str, Effect]) -> Hypothesis:
    """Return a cause fitted beside another model, from where it was fitted already.

    `effects` are all of the device by id.
    """
    parameters = cause.added_to(before.parameters)
    unknowns = unknowns_with(before, cause.ids, parameters, effects)
    return Hypothesis.of(cause.ids, before, settled(record, begun(record, parameters, unknowns, before.disturbance)))


def unknowns_with(
    before: Fitted, ids: tuple[str, ...], parameters: Float64, effects: Mapping[str, Effect]
) -> list[Unknown]:
    """Return what is fitted of a hypothesis beside the unknowns of a fit."""
    if ids == (DRIFT,):
        return [*before.unknowns, *drift_unknowns()]
    if ids[0] in effects:
        return [*before.unknowns, *unknowns_of(effects[ids[0]], parameters)]
    return freed(before.unknowns, [name.removeprefix(PARAMETER) for name in ids])
