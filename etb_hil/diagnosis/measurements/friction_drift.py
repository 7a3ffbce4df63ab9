"""Change of friction during the run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _drift(run: Findings) -> Estimate | None:
    """Return by which share friction changed in a second, where it did beyond doubt."""
    if run.drift is None:
        return None
    reach = TWO_SIDED_95 * run.drift.error
    return Estimate(run.drift.rate, run.drift.rate - reach, run.drift.rate + reach)


MEASUREMENT = MeasurementKind(
    id="friction_drift",
    name="change of friction in a second",
    unit="1/s",
    compute=_drift,
    order=340,
)
