"""The largest deviation of the plate sensor from the motor's encoder."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind
from etb_hil.diagnosis.motion.plate_sensor import deviation

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _compute(run: Findings) -> Estimate | None:
    return deviation(run)


MEASUREMENT = MeasurementKind(
    id="plate_sensor_deviation",
    name="largest deviation of the plate sensor",
    unit="rad",
    compute=_compute,
    order=105,
    phases=frozenset({"ramp"}),
    roles=frozenset({"throttle_angle", "command_position"}),
    is_model_free=True,
    source="half the range over opening and closing passes, the offset taken off (IEC 61298-2, inaccuracy)",
    too_high="look at the plate sensor, its magnet and the gear",
)
