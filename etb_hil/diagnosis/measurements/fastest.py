"""Highest speed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _fastest(run: Findings) -> Estimate:
    """Return the highest speed of the live estimates."""
    return Estimate(run.reading.fastest)


MEASUREMENT = MeasurementKind(
    id="fastest",
    name="highest speed",
    unit="rad/s",
    compute=_fastest,
    order=200,
    has_interval=False,
)
