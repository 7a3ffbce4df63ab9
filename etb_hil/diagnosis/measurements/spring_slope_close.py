"""The slope of the spring below limp-home."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind
from etb_hil.diagnosis.motion.springs import spring_line

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _compute(run: Findings) -> Estimate | None:
    found = spring_line(run, is_above=False)
    return None if found is None else found.slope


MEASUREMENT = MeasurementKind(
    id="spring_slope_close",
    name="spring slope below limp-home",
    unit="N·m/rad",
    compute=_compute,
    order=102,
    phases=frozenset({"ramp"}),
    roles=frozenset({"command_position"}),
    source="slope of the line through the mean of opening and closing torque; seed paper, fig. 3",
    too_high="look for a wrong spring",
    too_low="look for a spring that is weak, broken or hung wrongly",
)
