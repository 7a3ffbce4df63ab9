"""Highest estimate below omega_s."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _t_st_peak(run: Findings) -> Estimate:
    """Return the highest live estimate below omega_s."""
    return Estimate(run.reading.peak, note="seed paper, section III.C, strategy 1")


MEASUREMENT = MeasurementKind(
    id="T_st_peak",
    name="highest friction below the Stribeck velocity",
    unit="N·m",
    compute=_t_st_peak,
    order=120,
    source="seed paper, section III.C, strategy 1",
    has_interval=False,
)
