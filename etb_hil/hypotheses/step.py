"""One step of a search: the hypotheses beside what was found, and the next cause."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from etb_hil.base.side_by_side import side_by_side
from etb_hil.estimation.calibration import settled
from etb_hil.estimation.climbing import Fitted, begun, climbed
from etb_hil.estimation.filtering import Disturbance, filtered
from etb_hil.estimation.record import Record
from etb_hil.hypotheses.candidates import Candidate, can_show, candidates
from etb_hil.hypotheses.comparison import TOGETHER, Hypothesis, unknowns_with
from etb_hil.hypotheses.constants import (
    BEGUN,
    EQUIVALENT_SHAPE,
    FITTED,
    GAIN,
    HOPELESS,
    LIKELIEST,
    MATERIAL,
    NEEDED,
    PARAMETER,
)
from etb_hil.hypotheses.linear import Start, ranked
from etb_hil.hypotheses.misfit import ANY, Misfit, misfit
from etb_hil.hypotheses.starts import beginning, from_elsewhere, likelier
from etb_hil.hypotheses.terms import BENCH, DRIFT, Drift, drifts_in_tolerance
from etb_hil.hypotheses.waves import several
from etb_hil.plant.effects.effect import Effect
from etb_hil.recording.samples import Float64

# Where fits of hypotheses begin, by their ids: parameters and disturbance.
Begins = Mapping[tuple[str, ...], tuple[Float64, Disturbance]]
NONE: Begins = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Step:
    """What was compared beside the causes before it, the best first.

    `misfit`: that of the fit without any of them. `shares`: of each part of that, what a cause may leave.
    `is_material`: whether the best one leaves so little, or is the likeliest only.
    """

    misfit: Misfit
    hypotheses: tuple[Hypothesis, ...]
    shares: tuple[float, ...]
    is_material: bool

    @property
    def best(self) -> Hypothesis:
        """The hypothesis that the search goes on with."""
        return self.hypotheses[0]

    @property
    def group(self) -> tuple[Hypothesis, ...]:
        """The other hypotheses with a name that the best does not exclude.

        Where the best one matters only beside a later cause, no misfit tells yet. What is not equivalent to it takes
        less of its evidence than the square of a cosine of 0.95.
        """
        others = [one for one in self.hypotheses[1:] if not one.is_drift]
        if not self.is_material:
            least = (1.0 - EQUIVALENT_SHAPE**2) * self.best.evidence
            return tuple(one for one in others if one.evidence > least)
        others = [one for one in others if one.misfit.is_alternative_to(self.best.misfit, self.misfit, self.best.least)]
        return tuple(one for one in others if not self.best.excludes(one) and one.evidence > _least_evidence(self.best))

    @property
    def is_use(self) -> bool:
        """Whether friction drifts inside its tolerance, as use makes it do.

        Nothing with a name explains that as well.
        """
        is_alone = self.best.is_drift and self.is_material and not self.group
        return is_alone and drifts_in_tolerance(self.best.fit)


def stepped(
    record: Record,
    before: Fitted,
    effects: Mapping[str, Effect],
    without: Container[str] = (),
    shares: tuple[float, ...] = ANY,
    fitted_already: Begins = NONE,
) -> Step | None:
    """Return the likeliest hypotheses beside what a fit has already.

    `without`: ids that are none. A cause that matters leaves its share of a part of the misfit at most.
    `fitted_already`: where hypotheses ended beside fewer causes.
    """
    has = {one.effect.id for one in before.unknowns if one.effect}
    named = [one for id_, one in effects.items() if id_ not in without and id_ not in has]
    known: list[Candidate | Drift] = [*candidates(record, before.parameters, named)]
    known += several(record, before, [one for one in named if can_show(record, one)])
    if DRIFT not in without:
        known.append(Drift(before.parameters))
    base = [one.name for one in before.unknowns if one.effect is None and np.isfinite(one.reach)]
    base = [name for name in base if name not in BENCH and PARAMETER + name not in without]
    sets: list[tuple[str, ...]] = [(PARAMETER + name,) for name in base]
    sets += [tuple(PARAMETER + name for name in pair) for pair in TOGETHER if set(pair) <= set(base)]
    linear = ranked(record, before, known, sets)
    starts = [*side_by_side(lambda start: from_elsewhere(record, before, start, effects), linear)]
    starts = _begun_from(starts, fitted_already)
    if is_doubted(misfit(before), shares):
        # A cause with which so little misfit remains is among the likeliest of the linear pass: if none of those is
        # one, the others need no fit.
        step = decided(before, _fitted_from(record, before, starts[:LIKELIEST], effects, fitted_already), shares)
        if step is None or not step.is_material:
            return step
    return decided(before, _fitted_from(record, before, starts, effects, fitted_already), shares)


def _begun_from(starts: Sequence[Start], fitted_already: Container[tuple[str, ...]]) -> list[Start]:
    """Return the starts whose fits are begun, the likeliest first.

    They have enough of the linear evidence of the likeliest one, are among the likeliest, or were fitted already.
    """
    found = sorted(starts, key=lambda one: -one.evidence)
    least = HOPELESS * found[0].evidence if found else 0.0
    return [
        one
        for k, one in enumerate(found)
        if k < LIKELIEST or (k < FITTED and one.evidence > least) or one.ids in fitted_already
    ]


def _fitted_from(
    record: Record,
    before: Fitted,
    starts: Sequence[Start],
    effects: Mapping[str, Effect],
    fitted_already: Begins,
) -> list[Hypothesis]:
    """Return the hypotheses of some starts that are hopeful.

    Those that remain far behind the likeliest have no other starts. What was fitted beside less begins there, too.
    """
    few = record.few
    least = filtered(few, before.parameters, before.disturbance).log_likelihood
    begins = [(start, False) for start in starts]
    begins += [(start, True) for start in starts if start.ids in fitted_already]

    def tried(begin: tuple[Start, bool], aim: float) -> Hypothesis:
        start, is_fitted = begin
        p, disturbance = fitted_already[start.ids] if is_fitted else beginning(few, before, start, least)
        fit = climbed(record, begun(record, p, unknowns_with(before, start.ids, p, effects), disturbance), BEGUN, aim)
        return Hypothesis.of(start.ids, before, fit)

    def ended(begin: Hypothesis, best: Hypothesis | None) -> Hypothesis:
        aim = -np.inf if best is None else best.fit.posterior
        near = Hypothesis.of(begin.ids, before, climbed(record, begin.fit, aim=aim))
        if best is not None and best.excludes_by_far(near):
            return near
        if best is not None and near.misfit.lessens(best.misfit):
            aim = -np.inf  # it explains what the likeliest one does not: its end is worth knowing
        return Hypothesis.of(begin.ids, before, likelier(record, settled(record, near.fit, aim), begin.ids, aim))

    first = [tried(begin, -np.inf) for begin in begins[:1]]
    others = side_by_side(lambda begin: tried(begin, first[0].fit.posterior), begins[1:])
    hopeful = _hopeful(before, [*first, *others])
    found = [ended(begin, None) for begin in hopeful[:1]]
    found += side_by_side(lambda begin: ended(begin, found[0]), hopeful[1:])
    likeliest = {one.ids: one for one in sorted(found, key=lambda one: one.evidence)}
    return [*likeliest.values()]


def decided(before: Fitted, fits: Sequence[Hypothesis], shares: tuple[float, ...]) -> Step | None:
    """Return the step that some hypotheses make.

    None where no one is likelier than the fit before. The best one has a smaller misfit than that, if any has.
    """
    found = sorted((one for one in fits if not any(map(one.is_idle_beside, fits))), key=lambda one: -one.evidence)
    if not found or found[0].evidence <= GAIN:
        return None
    found = [one for one in found if one.evidence > _least_evidence(found[0])]
    left = misfit(before)
    lessening = [one for one in found if one.misfit.total < left.total] or found
    likeliest = [one for one in lessening if one.evidence > lessening[0].evidence - GAIN]
    # The largest part comes first: beside it, what explains another one may be fitted badly.
    material = [one for one in found if one.evidence > GAIN and one.misfit.lessens(left, shares)]
    material = [one for one in material if one.misfit[left.largest] < NEEDED * left[left.largest]] or material
    best = (material or likeliest)[0]
    if best.follows_temperature:
        # A temperature is a slow clock: a drift of any course that is about as likely may be use.
        best = next((one for one in material if one.is_drift and one.evidence > best.evidence - GAIN), best)
    return Step(left, (best, *(one for one in found if one is not best)), shares, bool(material))


def _least_evidence(likeliest: Hypothesis) -> float:
    """Return the evidence that others need to be compared with the likeliest one.

    What is no cause by itself may still be as likely as that one.
    """
    return min(GAIN, likeliest.evidence - GAIN)


def _hopeful(before: Fitted, tried: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return the hypotheses that gain enough beside the likeliest, that one first."""
    found = sorted(tried, key=lambda one: -one.fit.posterior)
    most = max((one.fit.posterior for one in found), default=before.posterior)
    least = most - (1.0 - HOPELESS) * max(most - before.posterior, 0.0)
    return [one for one in found if one.fit.posterior >= least]


def is_doubted(before: Misfit, shares: tuple[float, ...]) -> bool:
    """Tell whether the shape of a cause may have left each material part of a misfit."""
    return shares != ANY and all(part < MATERIAL or share < NEEDED for part, share in zip(before, shares, strict=True))
