"""Friction beyond 2.15 omega_s."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _t_c_literal(run: Findings) -> Estimate:
    """Return the mean live estimate beyond 2.15 omega_s."""
    return Estimate(run.reading.coulomb_literal, note="seed paper, section III.C, strategy 2 as printed")


MEASUREMENT = MeasurementKind(
    id="T_c_literal",
    name="friction above 2.15 Stribeck velocities",
    unit="N·m",
    compute=_t_c_literal,
    order=140,
    source="seed paper, section III.C, strategy 2 as printed",
    has_interval=False,
)
