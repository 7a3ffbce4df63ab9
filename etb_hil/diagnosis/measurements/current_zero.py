"""Zero of the current sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _current_zero(run: Findings) -> Estimate:
    """Return what the current sensor shows with the bridge off."""
    return Estimate(run.zero.current if run.zero.is_measured else None)


MEASUREMENT = MeasurementKind(
    id="current_zero",
    name="zero of the current sensor",
    unit="A",
    compute=_current_zero,
    order=210,
    phases=frozenset({"current_zero"}),
    is_model_free=True,
    has_interval=False,
)
