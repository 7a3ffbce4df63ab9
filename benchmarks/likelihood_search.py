"""Search for what a model lacks in a record, by the likelihood alone.

Calibrate, rank every hypothesis by one linear pass, fit the first ones, and accept the likeliest if it matters; then
look for another cause beside it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.estimation.calibration import Fitted, calibrated, climbed, settled
from etb_hil.estimation.record import Record
from etb_hil.estimation.unknown import base_unknowns
from etb_hil.hypotheses.candidates import candidates, freed, unknowns_of
from etb_hil.hypotheses.comparison import TOGETHER, Hypothesis, misfit
from etb_hil.hypotheses.constants import EQUIVALENT_PARAMETER, EQUIVALENT_SHAPE, GAIN, NEEDED, PARAMETER
from etb_hil.hypotheses.linear import Start, ranked
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.parameters import Model

NOTHING = 1.0  # misfit that is immaterial (decision 0038)
# These bound the processor time. They were chosen on a few development files, and explain_side_by_side.py checks them.
FITTED = 8  # hypotheses of the linear pass whose fit is begun
BEGUN = 2  # Gauss-Newton steps of that
HOPELESS = 0.1  # share of the gain of the likeliest that a hypothesis has after them, or it is excluded
MOST_CAUSES = 3
SEARCHED, PARTS = 12_000, 12  # samples of a record that are searched, and parts that they come in


@dataclass(frozen=True, slots=True)
class Step:
    """What was compared beside the causes before it, the likeliest first.

    `before`: the fit without any of them. `misfit` is that of `before`.
    """

    before: Fitted
    misfit: float
    hypotheses: tuple[Hypothesis, ...]

    @property
    def best(self) -> Hypothesis:
        """The likeliest hypothesis."""
        return self.hypotheses[0]

    @property
    def is_accepted(self) -> bool:
        """Whether the likeliest stands out of the noise, and matters."""
        best = self.best
        return self.misfit > NOTHING and best.evidence > GAIN and best.misfit < NEEDED * self.misfit

    @property
    def group(self) -> tuple[Hypothesis, ...]:
        """The other hypotheses that the likeliest does not exclude."""
        return tuple(one for one in self.hypotheses[1:] if not self.best.excludes(one) and one.evidence > GAIN)


@dataclass(frozen=True, slots=True)
class Found:
    """The steps of a search; the last one may hold no cause."""

    calibrated: Fitted
    steps: tuple[Step, ...]

    @property
    def causes(self) -> tuple[Step, ...]:
        """The steps whose likeliest hypothesis is a cause."""
        return tuple(step for step in self.steps if step.is_accepted)

    @property
    def final(self) -> Fitted:
        """The model with all causes."""
        return self.causes[-1].best.fit if self.causes else self.calibrated

    @property
    def verdict(self) -> str:
        """What the search comes to: adequate, explained, ambiguous, or unexplained."""
        if not self.causes:
            return "adequate" if misfit(self.calibrated) < NOTHING else "unexplained"
        return "ambiguous" if any(step.group for step in self.causes) else "explained"


def searched(whole: Record, model: Model, without: Sequence[str] = ()) -> Found:
    """Return what a record needs beside a model; `without`: ids that are not tried."""
    record = whole.thinned(SEARCHED, PARTS)
    first = before = calibrated(record, model.vector(), base_unknowns(model))
    ids = [id_ for id_ in CATALOGUE if id_ not in without]
    steps: list[Step] = []
    while len(steps) < MOST_CAUSES and misfit(before) > NOTHING:
        steps.append(stepped(record, before, ids))
        if not steps[-1].is_accepted:
            break
        before = steps[-1].best.fit
        if misfit(before) < _shape(steps[-1].best):
            break
    return Found(first, tuple(steps))


def _shape(cause: Hypothesis) -> float:
    """Return the misfit that a cause of another shape than the catalogue's may leave."""
    return (EQUIVALENT_PARAMETER if cause.is_of_numbers else EQUIVALENT_SHAPE) * cause.without


def stepped(record: Record, before: Fitted, ids: Iterable[str]) -> Step:
    """Return the likeliest hypotheses beside what a fit has already."""
    known = candidates(record, before.parameters, ids)
    base = [one.name for one in before.unknowns if one.effect is None and np.isfinite(one.reach)]
    sets: list[tuple[str, ...]] = [(PARAMETER + name,) for name in base]
    sets += [tuple(PARAMETER + name for name in pair) for pair in TOGETHER if set(pair) <= set(base)]
    begun = [_begun(record, before, start) for start in ranked(record, before, known, sets)[:FITTED]]
    begun.sort(key=lambda one: -one[1].posterior)
    least = before.posterior + HOPELESS * (begun[0][1].posterior - before.posterior)
    found: list[Hypothesis] = []
    for ids_, begin in begun:
        if begin.posterior >= least:
            aim = max((one.fit.posterior for one in found), default=-np.inf)
            fit = climbed(record, begin.parameters, begin.unknowns, begin.disturbance, aim=aim)
            fit = settled(record, fit, aim=aim)
            found.append(Hypothesis(ids_, fit.evidence - before.evidence, misfit(fit), misfit(before), fit))
    found = sorted((one for one in found if not any(map(one.is_idle_beside, found))), key=lambda one: -one.evidence)
    return Step(before, misfit(before), tuple(found))


def _begun(record: Record, before: Fitted, start: Start) -> tuple[tuple[str, ...], Fitted]:
    """Return a hypothesis with the first steps of its fit."""
    if start.ids[0] in CATALOGUE:
        unknowns = [*before.unknowns, *unknowns_of(CATALOGUE[start.ids[0]], start.parameters)]
    else:
        unknowns = freed(before.unknowns, [name.removeprefix(PARAMETER) for name in start.ids])
    return start.ids, climbed(record, start.parameters, unknowns, before.disturbance, BEGUN)
