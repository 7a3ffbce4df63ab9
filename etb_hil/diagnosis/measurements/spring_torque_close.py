"""The torque of the spring below limp-home."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind
from etb_hil.diagnosis.motion.springs import spring_line

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _compute(run: Findings) -> Estimate | None:
    found = spring_line(run, is_above=False)
    return None if found is None else found.torque


MEASUREMENT = MeasurementKind(
    id="spring_torque_close",
    name="spring torque below limp-home",
    unit="N·m",
    compute=_compute,
    order=100,
    phases=frozenset({"ramp"}),
    roles=frozenset({"command_position"}),
    source="line through the mean of opening and closing torque, at limp-home; seed paper, table I, T_close",
    too_high="look for a wrong spring",
    too_low="look for a spring that is weak, broken or hung wrongly",
)
