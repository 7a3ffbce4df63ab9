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
from etb_hil.hypotheses.candidates import candidates
from etb_hil.hypotheses.comparison import TOGETHER, Hypothesis, fitted, misfit, unknowns_with
from etb_hil.hypotheses.constants import EQUIVALENT_PARAMETER, EQUIVALENT_SHAPE, GAIN, MATERIAL, NEEDED, PARAMETER
from etb_hil.hypotheses.linear import Start, ranked
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.parameters import Model
from etb_hil.recording.samples import Float64

NOTHING = 1.0  # misfit that is immaterial (decision 0038)
# These bound the processor time. They were chosen on a few development files, and explain_side_by_side.py checks them.
FITTED = 8  # hypotheses of the linear pass whose fit is begun: with one round of variances
HOPELESS = 0.1  # share of the gain of the likeliest that a hypothesis has after that, or it is excluded
MOST_CAUSES = 3
SEARCHED, PARTS = 12_000, 12  # samples of a record that are searched, and parts that they come in


@dataclass(frozen=True, slots=True)
class Step:
    """What was compared beside the causes before it, the best first.

    `before`: the fit without any of them. `misfit` is that of `before`. `is_material`: whether the best one matters, or
    is the likeliest only.
    """

    before: Fitted
    misfit: float
    hypotheses: tuple[Hypothesis, ...]
    is_material: bool

    @property
    def best(self) -> Hypothesis:
        """The hypothesis that the search goes on with."""
        return self.hypotheses[0]

    @property
    def group(self) -> tuple[Hypothesis, ...]:
        """The other hypotheses that the best does not exclude.

        Where the best one matters only beside a later cause, no misfit tells yet. What is not equivalent to it takes
        less of its evidence than the square of a cosine of 0.95.
        """
        if not self.is_material:
            least = (1.0 - EQUIVALENT_SHAPE**2) * self.best.evidence
            return tuple(one for one in self.hypotheses[1:] if one.evidence > least)
        return tuple(one for one in self.hypotheses[1:] if not self.best.excludes(one) and one.evidence > GAIN)


@dataclass(frozen=True, slots=True)
class Found:
    """The steps of a search, and those of its causes."""

    calibrated: Fitted
    steps: tuple[Step, ...]
    causes: tuple[Step, ...]

    @property
    def final(self) -> Fitted:
        """The model with all causes."""
        return self.causes[-1].best.fit if self.causes else self.calibrated

    @property
    def verdict(self) -> str:
        """What the search comes to: adequate, explained, ambiguous, or unexplained."""
        left = misfit(self.final)
        if left < NOTHING and not self.causes:
            return "adequate"
        if not self.causes or left > max(NOTHING, EQUIVALENT_SHAPE * misfit(self.calibrated)):
            return "unexplained"
        return "ambiguous" if any(step.group for step in self.causes) else "explained"


def searched(whole: Record, model: Model, without: Sequence[str] = ()) -> Found:
    """Return what a record needs beside a model; `without`: ids that are not tried."""
    record = whole.thinned(SEARCHED, PARTS)
    first = before = calibrated(record, model.vector(), base_unknowns(model))
    steps: list[Step] = []
    while len(steps) < MOST_CAUSES and misfit(before) > _immaterial(steps):
        out = {*without, *_other_shapes(steps)}
        step = stepped(record, before, [id_ for id_ in CATALOGUE if id_ not in out])
        if step is None:
            break
        steps.append(step)
        before = step.best.fit
    causes = list(steps)
    while causes and not causes[-1].is_material:
        causes.pop()
    return Found(first, tuple(steps), tuple(_needed(record, first, causes)))


def _immaterial(steps: Sequence[Step]) -> float:
    """Return the misfit below which no other cause is looked for: another shape of one that is there may leave it."""
    if not steps:
        return NOTHING
    last = steps[-1]
    share = EQUIVALENT_PARAMETER if last.best.is_of_numbers else EQUIVALENT_SHAPE
    return max(MATERIAL, share * last.misfit if last.is_material else 0.0)


def _needed(record: Record, first: Fitted, causes: Sequence[Step]) -> list[Step]:
    """Return causes without those that do not matter beside the later ones."""
    found = list(causes)
    for k in reversed(range(len(causes) - 1)):
        later = found[k + 1 :]
        if not later:
            continue
        before = fit = found[k - 1].best.fit if k > 0 else first
        anew: list[Step] = []
        for step in later:
            one = fitted(record, fit, step.best.ids, _with(fit, step.best))
            compared = step if anew else found[k]  # beside fewer causes
            competing = [other for other in compared.hypotheses if other.ids != one.ids]
            anew.append(Step(fit, misfit(fit), (one, *competing), is_material=True))
            fit = one.fit
        if misfit(found[-1].best.fit) > NEEDED * misfit(fit):
            found[k:] = anew if misfit(fit) < NEEDED * misfit(before) else []
    return found


def _other_shapes(steps: Sequence[Step]) -> set[str]:
    """Return what is equivalent to a cause: beside it, that is the same cause in another shape."""
    return {id_ for step in steps for one in step.group for id_ in one.ids}


def _with(fit: Fitted, cause: Hypothesis) -> Float64:
    """Return a fit's parameters with those of a cause."""
    found = fit.parameters.copy()
    if cause.ids[0] in CATALOGUE:
        places = list(CATALOGUE[cause.ids[0]].stated_indices)
        found[places] = cause.fit.parameters[places]
    return found


def stepped(record: Record, before: Fitted, ids: Iterable[str]) -> Step | None:
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
            fit = settled(record, begin, aim=aim)
            found.append(Hypothesis(ids_, fit.evidence - before.evidence, misfit(fit), misfit(before), fit))
    found = sorted((one for one in found if not any(map(one.is_idle_beside, found))), key=lambda one: -one.evidence)
    found = [one for one in found if one.evidence > GAIN]
    if not found:
        return None
    without = misfit(before)
    material = [one for one in found if one.misfit < NEEDED * without]
    best = (material or found)[0]
    return Step(before, without, (best, *(one for one in found if one is not best)), bool(material))


def _begun(record: Record, before: Fitted, start: Start) -> tuple[tuple[str, ...], Fitted]:
    """Return a hypothesis with the first steps of its fit."""
    unknowns = unknowns_with(before, start.ids, start.parameters)
    fit = climbed(record, start.parameters, unknowns, before.disturbance)
    return start.ids, settled(record, fit, rounds=1)
