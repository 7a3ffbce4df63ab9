"""Search for what a model lacks in a record, by the likelihood alone.

Calibrate, rank every hypothesis by one linear pass, fit the first ones, and accept the likeliest if it matters; then
look for another cause beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

from etb_hil.base.side_by_side import side_by_side
from etb_hil.estimation.calibration import first_disturbance, settled
from etb_hil.estimation.climbing import Fitted, begun
from etb_hil.estimation.record import Record
from etb_hil.hypotheses.comparison import Hypothesis, are_numbers, fitted
from etb_hil.hypotheses.constants import (
    EQUIVALENT_PARAMETER,
    EQUIVALENT_SHAPE,
    GAIN,
    MATERIAL,
    MOST_CAUSES,
    NOTHING,
    PARAMETER,
)
from etb_hil.hypotheses.informative_part import informative_part
from etb_hil.hypotheses.misfit import ANY, misfit
from etb_hil.hypotheses.prepared import Prepared, prepared
from etb_hil.hypotheses.step import Begins, Step, decided, is_doubted, stepped
from etb_hil.hypotheses.terms import DRIFT
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.effects.port import Port
from etb_hil.plant.parameters import Model


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
        return tuple(step for step in self.needed if not step.best.is_drift)

    @property
    def final(self) -> Fitted:
        """The model with all that the record needs."""
        return self.needed[-1].best.fit if self.needed else self.calibrated

    @property
    def verdict(self) -> str:
        """What the search comes to: adequate, explained, ambiguous, or unexplained."""
        left = misfit(self.final)
        is_known = all(step.is_use for step in self.needed if step.best.is_drift)
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
            if not step.is_material and is_doubted(step.misfit, shares):
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
    return decided(before, begun_again, step.shares) or step


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
        anew = decided(before, [fitted(record, before, one, effects) for one in competing], ANY)
        if anew is not None and anew.is_material:
            found = [*others, anew]
    return found


def _other_shapes(steps: Sequence[Step]) -> set[str]:
    """Return causes, and what beside one would be the same cause in another shape."""
    return {id_ for step in steps for one in (step.best, *step.group) for id_ in one.ids}
