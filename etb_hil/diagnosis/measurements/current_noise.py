"""Noise of the current sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _current_noise(run: Findings) -> Estimate:
    """Return the standard deviation of a current sample with the bridge off."""
    return Estimate(run.zero.noise if run.zero.is_measured else None)


MEASUREMENT = MeasurementKind(
    id="current_noise",
    name="noise of the current sensor",
    unit="A",
    compute=_current_noise,
    order=220,
    phases=frozenset({"current_zero"}),
    is_model_free=True,
    has_interval=False,
)
