"""What a record would leave open if one member of an ambiguity group is true.

`expected_beside` forecasts it from the information of the record; `left_beside` explains the record.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.discrepancy.candidates.candidate import TOO_SMALL, file_name, own_name, parameter_id
from etb_hil.discrepancy.measured.filter_record import as_record
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.search.findings import SelectionStep
from etb_hil.estimation.record import Record, joined
from etb_hil.estimation.unknown import Unknown
from etb_hil.hypotheses.candidates import FittedEffect, can_show, candidates, freed
from etb_hil.hypotheses.comparison import least_excluded
from etb_hil.hypotheses.constants import GAIN, NOTHING, PARAMETER
from etb_hil.hypotheses.information import information_of
from etb_hil.hypotheses.informative_part import informative_part
from etb_hil.hypotheses.prepared import Prepared, prepared
from etb_hil.hypotheses.search import compared
from etb_hil.hypotheses.terms import with_room
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector
from etb_hil.recording.samples import Float64


@dataclass(frozen=True, slots=True)
class Truth:
    """A member of an ambiguity group that is taken as true, as it was fitted.

    `ids`: of it, or of parameters that leave their tolerances together.
    """

    ids: tuple[str, ...]
    parameters: Vector


@dataclass(frozen=True, slots=True)
class Left:
    """What a record leaves open beside the truth.

    `ids`: not excluded, or not to be tested; `distances` of others that were compared, in standard deviations of the
    sensors' noise; `shows`: that of no cause at all.
    """

    ids: tuple[str, ...]
    distances: dict[str, float]
    shows: float


def members(found: SelectionStep) -> list[Truth]:
    """Return a cause, and what was fitted of its ambiguity group."""
    ids = found.compared[0].ids if found.compared else (found.winner.id,)
    others = [one for one in found.compared[1:] if set(one.ids) & set(found.ambiguity_group)]
    own = found.winner.fit.whole if found.accepted else found.compared[0].parameters
    return [Truth(ids, own), *(Truth(one.ids, one.parameters) for one in others)]


def left_beside(
    truth: Truth, measured: Sequence[Measurement], model: Model, group: Sequence[str] | None = None
) -> Left | None:
    """Return what measurements leave open beside the truth.

    None where they do not show it.

    `group`: what else may be true; everything that the measurements can show where it is not given.
    """
    made = joined([as_record(one, model) for one in measured])
    if _is_measured(truth, model):
        return Left((), {}, np.inf)
    asked = None if group is None else [own_name(id_) for id_ in (*truth.ids, *group)]
    known = [own_name(one.id) for one in model.measured.values()]
    step = compared(made, model, asked, [*known, *map(parameter_id, TOO_SMALL)])
    found = {tuple(file_name(id_) for id_ in one.ids): one for one in step.hypotheses} if step else {}
    if step is None or truth.ids not in found:
        return None
    own, open_ = found[truth.ids], (step.best, *step.group)
    if not any(one is own for one in open_):
        return None
    left = {id_ for ids, one in found.items() if any(one is other for other in open_) for id_ in ids}
    blind = [id_ for id_ in group or () if id_ in CATALOGUE and not can_show(made, CATALOGUE[id_])]
    shows = float(np.sqrt(2.0 * step.best.evidence))
    away = dict.fromkeys(group or (), shows)  # where a fit was ended early: it gains hardly more
    away |= {id_: float(np.sqrt(2.0 * abs(own.evidence - one.evidence))) for ids, one in found.items() for id_ in ids}
    ids = dict.fromkeys([*sorted(left - set(truth.ids)), *blind])
    return Left(tuple(ids), away, shows)


def expected_beside(
    truth: Truth, others: Sequence[Truth], measured: Measurement, model: Model, group: Sequence[str]
) -> Left | None:
    """Return what a record would leave of a group beside the truth, to first order.

    None where it would not show the truth. `others`: members of the group as they were fitted. A member that was not
    fitted stays open where one of its shapes does.
    """
    if _is_measured(truth, model):
        return Left((), {}, np.inf)
    made = prepared(informative_part(as_record(measured, model), model), model)
    parameters = with_room(truth.parameters)
    record = made.record.placed(parameters)
    ids = [own_name(id_) for id_ in truth.ids]
    of_truth = _effects(record, made, parameters, ids[0], [])
    if not of_truth and not ids[0].startswith(PARAMETER):
        return None
    hypotheses = [*(one.ids for one in others), *((id_,) for id_ in group if not any(id_ in one.ids for one in others))]
    asked, numbers = [*of_truth], list[range]()
    for its in hypotheses:
        shapes = _effects(record, made, parameters, own_name(its[0]), others)
        numbers.append(range(len(asked), len(asked) + len(shapes)))
        asked += shapes
    known = information_of(record, parameters, _freed(made, truth.ids), asked)
    number, sizes = (0, -parameters[[one.place for one in of_truth[0].unknowns()]]) if of_truth else (None, np.zeros(0))
    lost, without = known.without(number, sizes, made.unknowns)
    if lost < GAIN or without < NOTHING:
        return None
    least, open_, distances = least_excluded(ids, 0.0, without), set[str](), dict[str, float]()
    for its, shapes_of_it in zip(hypotheses, numbers, strict=True):
        if not shapes_of_it and not own_name(its[0]).startswith(PARAMETER):
            open_.update(its)  # the record cannot show it
            continue
        tried = [known.without(number, sizes, _freed(made, its), one) for one in (shapes_of_it or (None,))]
        distances |= dict.fromkeys(its, float(np.sqrt(2.0 * min(lost_beside for lost_beside, _ in tried))))
        if any(lost_beside < GAIN or left < least for lost_beside, left in tried):
            open_.update(its)
    return Left(tuple(id_ for id_ in group if id_ in open_), distances, float(np.sqrt(2.0 * lost)))


def _effects(
    record: Record, made: Prepared, parameters: Float64, id_: str, others: Sequence[Truth]
) -> list[FittedEffect]:
    """Return an effect in its fitted shape, or in all of its shapes.

    There are none where the record cannot show it.
    """
    effect = made.effects.get(id_)
    if effect is None or not can_show(record, effect):
        return []
    if parameters[list(effect.acting_indices)].any():
        return [FittedEffect(effect, parameters)]
    found = next((one for one in others if id_ in one.ids), None)
    if found is None:
        return [FittedEffect(effect, one.parameters) for one in candidates(record, parameters, [effect])]
    shape = parameters.copy()
    there = [place for one, place in zip(effect.stated, effect.stated_indices, strict=True) if not one.is_strength]
    shape[there] = found.parameters[there]
    return [FittedEffect(effect, shape)]


def _is_measured(truth: Truth, model: Model) -> bool:
    """Tell whether a cause was measured at the bench: then nothing is ambiguous."""
    return set(truth.ids) <= {one.id for one in model.measured.values() if one.is_off}


def _freed(made: Prepared, ids: Sequence[str]) -> list[Unknown]:
    """Return the unknowns of a model, those of some ids beyond their tolerances."""
    return freed(made.unknowns, [own_name(id_).removeprefix(PARAMETER) for id_ in ids])
