"""Search for what a model lacks in a record, by the likelihood alone.

Calibrate, rank every hypothesis by one linear pass, fit the first ones, and accept the likeliest if it matters; then
look for another cause beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Container, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from etb_hil.base.side_by_side import side_by_side
from etb_hil.estimation.calibration import first_disturbance, settled
from etb_hil.estimation.climbing import Fitted, begun, climbed
from etb_hil.estimation.filtering import Disturbance, filtered
from etb_hil.estimation.record import Record
from etb_hil.hypotheses.candidates import Candidate, can_show, candidates
from etb_hil.hypotheses.comparison import TOGETHER, Hypothesis, are_numbers, fitted, unknowns_with
from etb_hil.hypotheses.constants import (
    BEGUN,
    EQUIVALENT_PARAMETER,
    EQUIVALENT_SHAPE,
    FITTED,
    GAIN,
    HOPELESS,
    LIKELIEST,
    MATERIAL,
    MOST_CAUSES,
    NEEDED,
    NOTHING,
    PARAMETER,
)
from etb_hil.hypotheses.informative_part import informative_part
from etb_hil.hypotheses.linear import Start, ranked
from etb_hil.hypotheses.misfit import ANY, Misfit, misfit
from etb_hil.hypotheses.prepared import Prepared, prepared
from etb_hil.hypotheses.starts import beginning, from_elsewhere, likelier
from etb_hil.hypotheses.terms import BENCH, DRIFT, Drift, drifts_in_tolerance
from etb_hil.hypotheses.waves import several
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.effects.port import Port
from etb_hil.plant.parameters import Model
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
        others = [one for one in self.hypotheses[1:] if one.ids != (DRIFT,)]
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
        is_drift = self.best.ids == (DRIFT,) and self.is_material and not self.group
        return is_drift and drifts_in_tolerance(self.best.fit)


@dataclass(frozen=True, slots=True)
class Found:
    """The steps of a search of a record, and those of what it needs, named or not."""

    record: Record
    calibrated: Fitted
    steps: tuple[Step, ...]
    needed: tuple[Step, ...]
    is_interrupted: bool = False

    @property
    def causes(self) -> tuple[Step, ...]:
        """The steps of the causes that have a name."""
        return tuple(step for step in self.needed if step.best.ids != (DRIFT,))

    @property
    def final(self) -> Fitted:
        """The model with all that the record needs."""
        return self.needed[-1].best.fit if self.needed else self.calibrated

    @property
    def verdict(self) -> str:
        """What the search comes to: adequate, explained, ambiguous, or unexplained."""
        left = misfit(self.final)
        unnamed = [step for step in self.needed if step.best.ids == (DRIFT,)]
        is_known = all(step.is_use for step in unnamed)
        if left.is_nothing and not self.needed:
            return "adequate"
        without = [misfit(self.calibrated), *(step.misfit for step in self.needed[:1])]
        if not self.needed or not is_known or not left.is_little(max(without, key=lambda one: one.total)):
            return "unexplained"
        if not self.causes:
            return "adequate"
        return "ambiguous" if any(step.group for step in self.causes) else "explained"


def searched(
    whole: Record,
    model: Model,
    without: Sequence[str] = (),
    progress: Callable[[str], None] = lambda _: None,
    ids: Sequence[str] | None = None,
) -> Found:
    """Return what a record needs beside a model; `without`: ids that are not tried.

    With `ids` only those are, and only where the model's misfit is material. Where the residual may be of the shape of
    a cause, another one has to explain all but little of it.
    """
    made = prepared(informative_part(whole, model), model)
    record, first = made.calibrated()
    out, immaterial = _left_out(made, ids, without), NOTHING if ids is None else MATERIAL
    steps: list[Step] = []
    is_interrupted = False
    try:
        first = _search(record, first, made.effects, out, progress, immaterial, steps)
    except KeyboardInterrupt:
        is_interrupted = True
    needed = list(steps)
    while needed and not needed[-1].is_material:
        needed.pop()
    late = None
    try:
        if len(needed) > 1 and not is_interrupted:
            progress("comparing the causes again, beside each other")
            needed = _needed(record, first, needed, made.effects)
            needed = _compared_again(record, first, needed, made.effects)
        if not is_interrupted:
            late = _late(record, needed[-1].best.fit if needed else first, set(without))
    except KeyboardInterrupt:
        is_interrupted = True
    return Found(record, first, tuple(steps), (*([late] if late else []), *needed), is_interrupted)


def _late(record: Record, fit: Fitted, without: Collection[str]) -> Step | None:
    """Return the step of a late reading that each model has, where it matters."""
    effects = {one.effect.id: one.effect for one in fit.unknowns if one.effect and record.is_read}
    for id_, effect in effects.items():
        places = list(effect.acting_indices)
        if id_ in without or not effect.acts_at(Port.CURRENT_LATENESS) or not fit.parameters[places].any():
            continue
        p = fit.parameters.copy()
        p[places] = 0.0
        others = [one for one in fit.unknowns if one.effect is not effect]
        # From the fit's disturbances, too: with others a descent may end on a hill that the delay has no part in.
        begins = [begun(record, p, others, each) for each in (fit.disturbance, first_disturbance(p))]
        before = max((settled(record, one) for one in begins), key=lambda one: one.posterior)
        found = Hypothesis.of((id_,), before, fit)
        if found.evidence > GAIN and found.misfit.lessens(found.without):
            return Step(found.without, (found,), ANY, is_material=True)
    return None


def _search(
    record: Record,
    first: Fitted,
    effects: Mapping[str, Effect],
    without: Collection[str],
    progress: Callable[[str], None],
    immaterial: float,
    steps: list[Step],
) -> Fitted:
    """Add one step after another, each beside the best of those before it.

    Returns the calibrated model. Base parameters that are likeliest inside their tolerances are no cause: the fits
    before them had ended in a local optimum, and begin again beside it.
    """
    before, in_tolerance = first, set[str]()
    while len(steps) < MOST_CAUSES and max(misfit(before)) > (MATERIAL if steps else immaterial):
        progress(f"looking for a cause beside {_named(steps)}" if steps else "looking for a cause")
        shares = _shares_beside(steps)
        out = {*without, *_other_shapes(steps), *in_tolerance}
        step = stepped(record, before, effects, out, shares, _fitted_before(steps))
        if step is None:
            break
        if step.best.is_in_tolerance(first.unknowns):
            in_tolerance.update(step.best.ids)
            last = steps.pop() if steps else None
            before = _begun_beside(record, steps[-1].best.fit if steps else first, step.best)
            if not steps:
                first = before
            if last is not None:
                steps.append(_compared_beside(record, before, last, step.best))
        elif step.is_material and (again := _begun_without(record, before, step.best)) is not None:
            first = first if steps else again
            if steps:
                steps[-1] = _ended_at(steps[-1], steps[-2].best.fit if len(steps) > 1 else first, again)
        else:
            steps.append(step)
            if not step.is_material and _is_doubted(step.misfit, shares):
                break
        before = steps[-1].best.fit if steps else first
    return first


def _begun_without(record: Record, before: Fitted, cause: Hypothesis) -> Fitted | None:
    """Return a likelier fit of the model before a cause, from where the cause ended.

    None where there is none: the model was at its best. Else the cause may have led away from a local optimum alone.
    """
    parameters = cause.added_to(cause.fit.parameters, before.parameters)
    found = settled(record, begun(record, parameters, before.unknowns, cause.fit.disturbance), before.posterior)
    return found if found.posterior > before.posterior + GAIN else None


def _ended_at(step: Step, before: Fitted, fit: Fitted) -> Step:
    """Return a step whose best hypothesis has another fit."""
    best = Hypothesis.of(step.best.ids, before, fit)
    return Step(step.misfit, (best, *step.hypotheses[1:]), step.shares, step.is_material)


def _compared_beside(record: Record, before: Fitted, step: Step, calibration: Hypothesis) -> Step:
    """Return a step with its fits begun again beside a calibration."""
    fits = side_by_side(lambda one: _begun_beside(record, one.fit, calibration, one.ids), step.hypotheses)
    begun_again = [Hypothesis.of(one.ids, before, fit) for one, fit in zip(step.hypotheses, fits, strict=True)]
    return _decided(before, begun_again, step.shares) or step


def _begun_beside(record: Record, fit: Fitted, calibration: Hypothesis, kept: Collection[str] = ()) -> Fitted:
    """Return a fit, or a likelier one from the base parameters of a calibration.

    `kept`: ids of base parameters that stay.
    """
    p = fit.parameters.copy()
    for one in fit.unknowns:
        if one.effect is None and one.term < 0 and PARAMETER + one.name not in kept:
            one.put(p, float(calibration.fit.parameters[one.place]))
    begins = [begun(record, p, fit.unknowns, one) for one in (first_disturbance(p), calibration.fit.disturbance)]
    return max(fit, settled(record, max(begins, key=lambda one: one.posterior)), key=lambda one: one.posterior)


def compared(whole: Record, model: Model, ids: Sequence[str] | None = None, without: Sequence[str] = ()) -> Step | None:
    """Return the likeliest hypotheses about a record, of some `ids` where given.

    None where none of them is likelier than the model; `without`: ids that are not tried.
    """
    made = prepared(informative_part(whole, model), model)
    record, before = made.calibrated()
    out = _left_out(made, ids, [*without, *(entry.id for entry in model.effects)])
    return stepped(record, before, made.effects, out)


def _left_out(made: Prepared, ids: Sequence[str] | None, without: Sequence[str]) -> set[str]:
    """Return the ids that are not tried: `without`, and all but `ids` where given."""
    known = {DRIFT, *made.effects, *(PARAMETER + one.name for one in made.unknowns)}
    return {*without, *(id_ for id_ in known if ids is not None and id_ not in ids)}


def _named(steps: Sequence[Step]) -> str:
    return " and ".join(id_ for step in steps for id_ in step.best.ids)


def _fitted_before(steps: Sequence[Step]) -> Begins:
    """Return where hypotheses ended beside fewer causes, with all later ones added."""
    found = {}
    for k, step in enumerate(steps):
        for one in step.hypotheses:
            parameters = one.fit.parameters
            for later in steps[k:]:
                parameters = later.best.added_to(parameters)
            found[one.ids] = parameters, one.fit.disturbance
    return found


def _shares_beside(steps: Sequence[Step]) -> tuple[float, ...]:
    """Return which share of each part of the misfit another cause may leave.

    What one of the causes has left of a part may be there because its shape is not quite ours.
    """
    shares = list(ANY)
    for step in filter(lambda step: step.is_material, steps):
        equivalent = EQUIVALENT_PARAMETER if are_numbers(step.best.ids) else EQUIVALENT_SHAPE
        for part, is_its in enumerate(step.best.misfit.lessened_to(step.misfit, equivalent)):
            if is_its:
                shares[part] = EQUIVALENT_PARAMETER
    return tuple(shares)


def _is_doubted(before: Misfit, shares: tuple[float, ...]) -> bool:
    """Tell whether the shape of a cause may have left each material part of a misfit."""
    return shares != ANY and all(part < MATERIAL or share < NEEDED for part, share in zip(before, shares, strict=True))


def _needed(record: Record, first: Fitted, causes: Sequence[Step], effects: Mapping[str, Effect]) -> list[Step]:
    """Return causes without those that do not matter beside the later ones."""
    found = list(causes)
    for k in reversed(range(len(causes) - 1)):
        later = found[k + 1 :]
        if not later:
            continue
        before = fit = found[k - 1].best.fit if k > 0 else first
        anew: list[Step] = []
        for step in later:
            one = _fitted_without(record, before, fit, found[k].best, step.best, effects)
            compared = step if anew else found[k]  # beside fewer causes
            competing = [other for other in compared.hypotheses if other.ids != one.ids]
            anew.append(Step(misfit(fit), (one, *competing), ANY, is_material=True))
            fit = one.fit
        if not misfit(found[-1].best.fit).lessens(misfit(fit)):
            found[k:] = anew if misfit(fit).lessens(misfit(before)) else []
    return found


def _fitted_without(
    record: Record,
    first: Fitted,
    before: Fitted,
    out: Hypothesis,
    cause: Hypothesis,
    effects: Mapping[str, Effect],
) -> Hypothesis:
    """Return a later cause fitted beside a model without an earlier one, `out`.

    `first` is the model before that one. The fit begins where it ended beside that one, too: from the model alone no
    slope may lead there.
    """
    alone = fitted(record, before, cause, effects)
    parameters = out.added_to(cause.fit.parameters, first.parameters)
    begin = begun(record, parameters, alone.fit.unknowns, cause.fit.disturbance)
    beside = settled(record, begin)
    return alone if alone.fit.posterior >= beside.posterior else Hypothesis.of(cause.ids, before, beside)


def _compared_again(record: Record, first: Fitted, causes: Sequence[Step], effects: Mapping[str, Effect]) -> list[Step]:
    """Return causes whose competing hypotheses were compared beside all others.

    A cause that mattered only beside a later one was compared while what that explains was still there, and any
    hypothesis takes a part of it. It comes last then. Where no hypothesis is a cause beside the others, the step stays.
    """
    found = list(causes)
    for step in causes[:-1]:
        if step.is_material:
            continue
        others, before = [one for one in found if one is not step], first
        for one in others:
            before = fitted(record, before, one.best, effects).fit
        named = {id_ for one in others for id_ in one.best.ids}
        competing = [one for one in step.hypotheses if not named & set(one.ids)]
        anew = _decided(before, [fitted(record, before, one, effects) for one in competing], ANY)
        if anew is not None and anew.is_material:
            found = [*others, anew]
    return found


def _other_shapes(steps: Sequence[Step]) -> set[str]:
    """Return causes, and what beside one would be the same cause in another shape."""
    return {id_ for step in steps for one in (step.best, *step.group) for id_ in one.ids}


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
    `fitted_already`: see `_fitted_before`.
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
    if _is_doubted(misfit(before), shares):
        # A cause with which so little misfit remains is among the likeliest of the linear pass: if none of those is
        # one, the others need no fit.
        step = _decided(before, _fitted_from(record, before, starts[:LIKELIEST], effects, fitted_already), shares)
        if step is None or not step.is_material:
            return step
    return _decided(before, _fitted_from(record, before, starts, effects, fitted_already), shares)


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


def _decided(before: Fitted, fits: Sequence[Hypothesis], shares: tuple[float, ...]) -> Step | None:
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
        best = next((one for one in material if one.ids == (DRIFT,) and one.evidence > best.evidence - GAIN), best)
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
