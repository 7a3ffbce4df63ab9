"""Isolability of effects in the records of planned scenarios."""

from __future__ import annotations

from collections.abc import Sequence

from etb_hil.discrepancy.candidates.candidate import no_part_of
from etb_hil.discrepancy.measured.filter_record import as_record
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.estimation.record import joined
from etb_hil.hypotheses.candidates import candidates
from etb_hil.hypotheses.constants import PARTS, SEARCHED
from etb_hil.hypotheses.information import Isolability, information_of, isolability
from etb_hil.hypotheses.prepared import prepared
from etb_hil.plant.parameters import Model


def isolability_of(model: Model, records: Sequence[Sequence[Measurement]]) -> Isolability:
    """Return which effects the records of some scenarios isolate together.

    Each record has one segment at least.
    """
    thinned = [joined([as_record(one, model) for one in parts]).thinned(SEARCHED, PARTS) for parts in records]
    made = prepared(joined(thinned), model)
    record, fit = made.calibrated()
    without = no_part_of(model.device)
    shapes = candidates(record, fit.parameters, [one for id_, one in made.effects.items() if id_ not in without])
    return isolability(information_of(record, fit.parameters, fit.unknowns, shapes))
