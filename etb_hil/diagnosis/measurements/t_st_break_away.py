"""Break-away friction after a rest."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from etb_hil.diagnosis.break_away import break_away_torque
from etb_hil.diagnosis.measurement_kind import MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings
    from etb_hil.diagnosis.measurement_kind import Estimate


def _break_away(run: Findings) -> Estimate | None:
    """Return the mean of the break-aways in both directions.

    The mean is brought to the rest that the limit is stated for.
    """
    law = run.dwell
    found = break_away_torque(run.broken_away, None if law is None else law.factor)
    if found is None:
        return None
    note = f"mean of {found.count}, in both directions"
    if law is not None:
        note += f", brought to a rest of {law.reference:g} s"
    return replace(run.with_gain(found.read), note=note)


MEASUREMENT = MeasurementKind(
    id="T_st_break_away",
    name="break-away friction after a rest",
    unit="N·m",
    compute=_break_away,
    order=60,
    is_friction=True,
    judged_at_rest_by="T_st",
    source="Dieterich 1979 for the law of rest",
)
