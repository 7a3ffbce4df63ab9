"""Viscous friction sigma_2."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings
    from etb_hil.diagnosis.measurement_kind import Estimate


def _viscous(run: Findings) -> Estimate | None:
    """Return the fitted slope of friction over speed.

    None where time or place passes for speed.
    """
    found = run.fitted.get("viscous")
    if found is None or run.widening.is_confounded:
        return None
    return run.with_gain(found)


MEASUREMENT = MeasurementKind(
    id="viscous",
    name="viscous friction",
    unit="N·m·s/rad",
    compute=_viscous,
    order=50,
    too_high="Replace the unit: its grease or bearings drag.",
    source="seed paper, eq. (2)",
)
