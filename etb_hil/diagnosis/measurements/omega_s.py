"""Stribeck velocity omega_s."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _stribeck_velocity(run: Findings) -> Estimate | None:
    """Return the fitted speed at which friction has fallen.

    None where time or place passes for speed. It has no value where friction goes by no law.
    """
    if run.misfit is not None:
        return Estimate(None, note="friction over speed goes by no known law")
    found = run.fitted.get("omega_s")
    if found is None or run.widening.is_confounded:
        return None
    return Estimate(found.value, found.low, found.high)


MEASUREMENT = MeasurementKind(
    id="omega_s",
    name="Stribeck velocity",
    unit="rad/s",
    compute=_stribeck_velocity,
    order=40,
    source="seed paper, eq. (2)",
)
