"""Friction beyond 2.15 omega_s less viscosity."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _t_c_live(run: Findings) -> Estimate:
    """Return the mean live estimate beyond 2.15 omega_s, less the viscous torque."""
    return Estimate(run.reading.coulomb, note="seed paper, section III.C, strategy 2, corrected")


MEASUREMENT = MeasurementKind(
    id="T_c_live",
    name="sliding friction, live",
    unit="N·m",
    compute=_t_c_live,
    order=130,
    source="seed paper, section III.C, strategy 2, corrected",
    has_interval=False,
)
