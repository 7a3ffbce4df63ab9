"""What a record would leave open if one member of an ambiguity group is true."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.discrepancy.candidates.candidate import TOO_SMALL, file_name, own_name, parameter_id
from etb_hil.discrepancy.measured.filter_record import as_record
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.search.findings import SelectionStep
from etb_hil.estimation.record import joined
from etb_hil.hypotheses.candidates import can_show
from etb_hil.hypotheses.search import compared
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector


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
