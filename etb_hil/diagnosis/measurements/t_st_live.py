"""T_st from slow sliding, live."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _t_st_live(run: Findings) -> Estimate:
    """Return the mean of slow sliding in both directions, from the live estimates."""
    return Estimate(run.reading.stiction)


MEASUREMENT = MeasurementKind(
    id="T_st_live",
    name="break-away friction, live",
    unit="N·m",
    compute=_t_st_live,
    order=110,
    has_interval=False,
)
