"""Windows behind the fit."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _windows(run: Findings) -> Estimate:
    """Return how many windows of steady motion the fit rests on."""
    return Estimate(float(len(run.assessment.evidence)))


MEASUREMENT = MeasurementKind(
    id="windows",
    name="windows behind the fit",
    unit="1",
    compute=_windows,
    order=240,
    has_interval=False,
)
