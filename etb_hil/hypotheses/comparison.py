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
    IMMATERIAL,
    MATERIAL,
    NEEDED,
    NOTHING,
    PARAMETER,
    WHITE,
)
from etb_hil.hypotheses.terms import BENCH, DRIFT, drift_unknowns
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import COULOMB, RESISTANCE, TORQUE_PER_AMPERE
from etb_hil.recording.samples import Float64

# Sliding friction and break-away friction are of the same contacts.
TOGETHER = (("coulomb", "stiction"),)


def are_numbers(ids: Sequence[str]) -> bool:
    """Tell whether a cause is made of base parameters, which have no shape."""
    return ids[0].startswith(PARAMETER)


def least_excluded(ids: Sequence[str], misfit: float, without: float) -> float:
    """Return the misfit above which a cause may exclude another hypothesis.

    `misfit`, `without`: with the cause and without it.
    """
    if are_numbers(ids) and misfit < NOTHING:
        return NOTHING  # a shape that a number explains without a residual would be that number's by chance
    return max(MATERIAL, (EQUIVALENT_PARAMETER if are_numbers(ids) else EQUIVALENT_SHAPE) * without)


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """A cause as fitted: an effect, or base parameters out of their tolerances.

    Such parameters leave their tolerances together.

    `evidence` in nats over the calibrated model. `misfit`, `without`: with it and without it, see `misfit`.
    """

    ids: tuple[str, ...]
    evidence: float
    misfit: float
    without: float
    fit: Fitted

    @classmethod
    def of(cls, ids: tuple[str, ...], before: Fitted, fit: Fitted) -> Hypothesis:
        """Return the hypothesis that a fit is, beside the calibrated model before it."""
        return cls(ids, fit.evidence - before.evidence, misfit(fit), misfit(before), fit)

    @property
    def effect(self) -> Effect | None:
        """The effect that it is, None where it is none."""
        return next((one.effect for one in self.fit.unknowns if one.effect and one.effect.id in self.ids), None)

    def added_to(self, parameters: Float64) -> Float64:
        """Return a whole vector with the parameters of the cause."""
        found, own = parameters.copy(), self.fit.parameters
        if self.ids == (DRIFT,):
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
        than one that the data cannot distinguish from the cause, and the cause removes much of it.
        """
        least = least_excluded(self.ids, self.misfit, self.without)
        is_likelier = self.evidence > other.evidence + GAIN
        return is_likelier and other.misfit > least and self.misfit < NEEDED * other.misfit

    def excludes_by_far(self, near: Hypothesis) -> bool:
        """Tell whether another one is excluded, and no other start will change that.

        It gains two thirds of this one at most, and would be excluded with two thirds of its misfit, too. `near`: that
        one where its first descent ended.
        """
        least = least_excluded(self.ids, self.misfit, self.without)
        is_behind = self.evidence > GAIN and near.evidence < NEEDED * self.evidence - GAIN
        return is_behind and NEEDED * near.misfit > max(least, self.misfit / NEEDED)

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


def _needed_torque(fit: Fitted) -> float:
    """Return the rms of what a disturbance explains, in N·m.

    Of a voltage it is the torque of its current at rest; below its noise a voltage is not known.
    """
    torque, voltage = fit.filtered.needed
    voltage = np.sqrt(max(voltage**2 - fit.filtered.voltage_noise**2, 0.0))
    return float(np.hypot(torque, fit.parameters[TORQUE_PER_AMPERE] / fit.parameters[RESISTANCE] * voltage))


def misfit(fit: Fitted) -> float:
    """Return the misfit of a fit; below 1 it is immaterial (see `constants`).

    Its parts: the disturbance that it needs, noise beyond what is stated of the sensors, and parameters beyond their
    tolerances.
    """
    disturbance = _needed_torque(fit) / (IMMATERIAL * fit.parameters[COULOMB])
    noise = [*_variances(fit), fit.disturbance.noise.voltage]
    beyond = sum(max(one - 1.0, 0.0) / WHITE for one in noise)
    return float(np.sqrt(disturbance**2 + beyond + float(np.sum(over(fit.parameters, fit.unknowns) ** 2))))


def _variances(fit: Fitted) -> list[float]:
    """Return the mean square of each reading's innovations over the stated noise.

    Instants without a reading do not count.
    """
    whitened, roots, noise = fit.filtered.whitened, fit.filtered.roots, fit.disturbance.noise
    scales = (noise.current, 1.0, noise.plate)
    return [
        scale * float(np.mean(w[r > 0.0] ** 2))
        for w, r, scale in zip(whitened.T, roots.T, scales, strict=True)
        if (r > 0.0).any()
    ]
