"""Compare hypotheses about one record by their evidence.

Each is fitted with disturbances of its own.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.estimation.calibration import Fitted, calibrated, climbed, over, settled
from etb_hil.estimation.record import Record
from etb_hil.estimation.unknown import Unknown, base_unknowns
from etb_hil.hypotheses.candidates import candidates, freed, unknowns_of
from etb_hil.hypotheses.constants import (
    EQUIVALENT_PARAMETER,
    EQUIVALENT_SHAPE,
    GAIN,
    IMMATERIAL,
    MATERIAL,
    NEEDED,
    PARAMETER,
    RARE,
    WHITE,
)
from etb_hil.hypotheses.linear import ranked
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import COULOMB, RESISTANCE, TORQUE_PER_AMPERE
from etb_hil.recording.samples import Float64

# Sliding friction and break-away friction are of the same contacts.
TOGETHER = (("coulomb", "stiction"),)


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

    @property
    def is_of_numbers(self) -> bool:
        """Whether it is made of base parameters, which have no shape."""
        return self.ids[0].startswith(PARAMETER)

    @property
    def faults(self) -> int:
        """The number of independent faults.

        An effect is one, as are parameters of the same contacts.
        """
        ids = set(self.ids)
        return len(ids) - sum({PARAMETER + one for one in pair} <= ids for pair in TOGETHER)

    @property
    def explains_all_but_little(self) -> bool:
        """Tell whether its misfit is so small that no other shape is in it."""
        return self.is_of_numbers and self.misfit < EQUIVALENT_PARAMETER * self.without

    def excludes(self, other: Hypothesis) -> bool:
        """Tell whether another one is less likely for more than its shape.

        A shape of the catalogue may not quite be the unit's.

        Nats alone do not tell: a shape that is not quite ours costs some. What is excluded has a larger misfit
        than one that the data cannot distinguish from the cause, and the cause removes much of it. Or it is a
        coincidence: several independent faults that together leave no less than the cause does.
        """
        more = other.faults - self.faults
        if more > 0 and self.misfit <= other.misfit and self.evidence + RARE * more > other.evidence + GAIN:
            return True
        equivalent = (EQUIVALENT_PARAMETER if self.is_of_numbers else EQUIVALENT_SHAPE) * self.without
        is_likelier = self.evidence > other.evidence + GAIN
        return is_likelier and other.misfit > max(equivalent, MATERIAL) and self.misfit < NEEDED * other.misfit

    def is_idle_beside(self, other: Hypothesis) -> bool:
        """Tell whether it is another one with more in it, which gains nothing."""
        return set(other.ids) < set(self.ids) and self.evidence < other.evidence + GAIN


def compared(
    record: Record, model: Model, ids: Sequence[str], present: Float64, others: Iterable[str] = ()
) -> list[Hypothesis]:
    """Return hypotheses about a record, the likeliest first.

    What the record cannot show is left out.

    `ids`: a cause, and what else may be it: effects, and `parameter:` with the name of a base parameter. Parameters may
    do together what none of them does alone, so all of the others are one hypothesis. `present`: a whole vector in
    which the effects `others` have been found; they are fitted beside each hypothesis.
    """
    beside = [one for id_ in others for one in unknowns_of(CATALOGUE[id_], present)]
    start = model.vector()
    for one in beside:
        start[one.place] = present[one.place]
    before = calibrated(record, start, [*base_unknowns(model), *beside])
    known = candidates(record, before.parameters, [id_ for id_ in ids if id_ in CATALOGUE])
    found: list[Hypothesis] = []
    for first in ranked(record, before, known, _sets_of(ids, before)):
        aim = max((one.fit.posterior for one in found), default=-np.inf)
        found.append(fitted(record, before, first.ids, first.parameters, aim))
    # One with more in it than another has to be likelier for a reason.
    return sorted((one for one in found if not any(map(one.is_idle_beside, found))), key=lambda one: -one.evidence)


def misfit_of_model(record: Record, model: Model) -> float:
    """Return the misfit of a model calibrated inside its tolerances."""
    return misfit(calibrated(record, model.vector(), base_unknowns(model)))


def misfit_with(record: Record, model: Model, id_: str, present: Float64) -> float:
    """Return the misfit of a model with one cause; `present`: a vector that has it."""
    before = calibrated(record, model.vector(), base_unknowns(model))
    start = before.parameters.copy()
    if id_ in CATALOGUE:
        places = list(CATALOGUE[id_].stated_indices)
        start[places] = present[places]
    return fitted(record, before, (id_,), start).misfit


def _sets_of(ids: Sequence[str], before: Fitted) -> list[tuple[str, ...]]:
    """Return the sets of base parameters that form one hypothesis each.

    Those of a set leave their tolerances together.
    """
    base = {PARAMETER + one.name for one in before.unknowns if one.effect is None}
    first, *rest = [id_ if id_ in base else "" for id_ in ids]
    rest = [id_ for id_ in rest if id_]
    found = [(first,), tuple(rest)]
    for pair in TOGETHER:
        both = tuple(PARAMETER + name for name in pair)
        if set(both) & {first, *rest} and set(both) <= base:
            found += [*((one,) for one in both if one in rest), both]
    return [one for one in dict.fromkeys(found) if one and one[0]]


def fitted(
    record: Record, before: Fitted, ids: tuple[str, ...], parameters: Float64, aim: float = -np.inf
) -> Hypothesis:
    """Return a hypothesis fitted with the unknowns of the calibrated model.

    The fit begins from the given parameters.
    `aim` is the posterior of the likeliest one so far: what is far behind it is not fitted to the last nat.
    """
    unknowns = unknowns_with(before, ids, parameters)
    fit = settled(record, climbed(record, parameters, unknowns, before.disturbance, aim=aim), aim=aim)
    return Hypothesis(ids, fit.evidence - before.evidence, misfit(fit), misfit(before), fit)


def unknowns_with(before: Fitted, ids: tuple[str, ...], parameters: Float64) -> list[Unknown]:
    """Return what is fitted of a hypothesis beside the unknowns of a fit."""
    if ids[0] in CATALOGUE:
        return [*before.unknowns, *unknowns_of(CATALOGUE[ids[0]], parameters)]
    return freed(before.unknowns, [name.removeprefix(PARAMETER) for name in ids])


def _needed_torque(fit: Fitted) -> float:
    """Return the rms of what a disturbance explains, in N·m.

    Of a voltage it is the torque of its current at rest.
    """
    torque, voltage = fit.filtered.needed
    return float(np.hypot(torque, fit.parameters[TORQUE_PER_AMPERE] / fit.parameters[RESISTANCE] * voltage))


def misfit(fit: Fitted) -> float:
    """Return the misfit of a fit; below 1 it is immaterial (see `constants`).

    Its parts: the disturbance that it needs, innovations beyond their noise, and parameters beyond their tolerances.
    """
    disturbance = _needed_torque(fit) / (IMMATERIAL * fit.parameters[COULOMB])
    beyond = sum(max(one - 1.0, 0.0) / WHITE for one in _variances(fit))
    return float(np.sqrt(disturbance**2 + beyond + float(np.sum(over(fit.parameters, fit.unknowns) ** 2))))


def _variances(fit: Fitted) -> list[float]:
    """Return the mean square of each reading's whitened innovations.

    Instants without a reading do not count.
    """
    whitened, roots = fit.filtered.whitened, fit.filtered.roots
    return [float(np.mean(w[r > 0.0] ** 2)) for w, r in zip(whitened.T, roots.T, strict=True) if (r > 0.0).any()]
