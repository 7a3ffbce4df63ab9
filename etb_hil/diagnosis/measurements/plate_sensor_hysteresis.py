"""The largest difference of the plate sensor between opening and closing.

Both are taken at one angle of the encoder.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind
from etb_hil.diagnosis.motion.plate_sensor import hysteresis

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _compute(run: Findings) -> Estimate | None:
    return hysteresis(run)


MEASUREMENT = MeasurementKind(
    id="plate_sensor_hysteresis",
    name="hysteresis of the plate sensor",
    unit="rad",
    compute=_compute,
    order=106,
    phases=frozenset({"ramp"}),
    roles=frozenset({"throttle_angle", "command_position"}),
    is_model_free=True,
    source="largest difference between opening and closing at one angle (IEC 61298-2, hysteresis)",
    too_high="look for play in the gear and a sensor that lags",
)
