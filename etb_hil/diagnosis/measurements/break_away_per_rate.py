"""Increase of break-away friction per ten times quicker ramp."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.break_away import break_away_torque
from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _per_rate(run: Findings) -> Estimate | None:
    """Return the share that T_st gains, with its interval.

    None where the rates are too close together.
    """
    found = break_away_torque(run.broken_away, None if run.dwell is None else run.dwell.factor)
    return None if found is None or found.per_rate is None else Estimate(*found.per_rate)


MEASUREMENT = MeasurementKind(
    id="break_away_per_rate",
    name="increase of break-away friction per tenfold rate",
    unit="1",
    compute=_per_rate,
    order=80,
)
