"""What a record would leave open if one member of an ambiguity group is true.

`expected_beside` forecasts it from the information of the record, in one pass; `left_beside` explains the record.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.discrepancy.candidates.candidate import TOO_SMALL, file_name, own_name, parameter_id
from etb_hil.discrepancy.measured.filter_record import as_record
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.search.findings import SelectionStep
from etb_hil.estimation.record import Record, joined
from etb_hil.estimation.unknown import Unknown
from etb_hil.hypotheses.candidates import Candidate, can_show, candidates, freed
from etb_hil.hypotheses.comparison import least_excluded
from etb_hil.hypotheses.constants import GAIN, NOTHING, PARAMETER, PARTS, SEARCHED
from etb_hil.hypotheses.information import information_of
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
    if set(truth.ids) <= {one.id for one in model.measured.values() if one.is_off}:
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

    None where it would not show the truth. `others`: members of the group as they were fitted.
    """
    made = prepared(as_record(measured, model).thinned(SEARCHED, PARTS), model)
    parameters = with_room(truth.parameters)
    record = made.record.placed(parameters)
    fitted = {id_: one for one in others for id_ in one.ids}
    ids = [own_name(id_) for id_ in truth.ids]
    asked = [one for id_ in (*ids, *group) if (one := _as_fitted(record, made, parameters, id_, fitted)) is not None]
    number = {one.id: k for k, one in enumerate(asked)}
    true = number.get(ids[0])
    if true is None and not ids[0].startswith(PARAMETER):
        return None
    known = information_of(record, parameters, _freed(made, truth.ids), asked)
    sizes = np.zeros(0) if true is None else -parameters[[one.place for one in asked[true].unknowns()]]
    lost, without = known.without(true, sizes, made.unknowns)
    if lost < GAIN or without < NOTHING:
        return None
    open_, distances = [], {}
    for id_ in group:
        its = fitted[id_].ids if id_ in fitted else (id_,)
        if own_name(id_) not in number and not own_name(id_).startswith(PARAMETER):
            open_.append(id_)
            continue
        lost_beside, left = known.without(true, sizes, _freed(made, its), number.get(own_name(id_)))
        distances[id_] = float(np.sqrt(2.0 * lost_beside))
        if lost_beside < GAIN or left < least_excluded(ids, 0.0, without):
            open_.append(id_)
    return Left(tuple(open_), distances, float(np.sqrt(2.0 * lost)))


def _as_fitted(
    record: Record, made: Prepared, parameters: Float64, id_: str, fitted: Mapping[str, Truth]
) -> Candidate | None:
    """Return an effect in its fitted shape; None where the record cannot show it."""
    effect = made.effects.get(id_)
    if effect is None or not can_show(record, effect):
        return None
    if id_ not in fitted:
        shapes = candidates(record, parameters, [effect])
        return (
            Candidate(effect, parameters) if parameters[list(effect.acting_indices)].any() else shapes[len(shapes) // 2]
        )
    shape = parameters.copy()
    there = [place for one, place in zip(effect.stated, effect.stated_indices, strict=True) if not one.is_strength]
    shape[there] = fitted[id_].parameters[there]
    return Candidate(effect, shape)


def _freed(made: Prepared, ids: Sequence[str]) -> list[Unknown]:
    """Return the unknowns of a model, those of some ids beyond their tolerances."""
    return freed(made.unknowns, [own_name(id_).removeprefix(PARAMETER) for id_ in ids])
