"""The limp-home position, where springs leave the plate.

The plate is approached from both sides.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from etb_hil.diagnosis.half_width import combined
from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind
from etb_hil.diagnosis.motion.returns import not_at_rest, returns
from etb_hil.diagnosis.motion.sensors import plate_rounding

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _compute(run: Findings) -> Estimate | None:
    found = returns(run)
    sides = [[one for one in found if one.is_opening is opening] for opening in (True, False)]
    if not all(sides) or any(math.isnan(one.plate) for one in found):
        return None
    if (instead := not_at_rest(found)) is not None:
        return instead
    plates = [[one.plate for one in side] for side in sides]
    value = 0.5 * sum(sum(side) / len(side) for side in plates)
    # Noise of the sensor is in the scatter of the rests already; alone it is the least that they scatter by.
    noise = math.hypot(*(max(one.plate_error for one in side) / math.sqrt(len(side)) for side in sides))
    reach = combined((plate_rounding(run.model),), 0.5 * noise)
    note = (
        f"mean of {len(sides[1])} returns from the open and {len(sides[0])} from the closed side, by the plate sensor"
    )
    return Estimate(value, value - reach, value + reach, note)


MEASUREMENT = MeasurementKind(
    id="default_position",
    name="limp-home position",
    unit="rad",
    compute=_compute,
    order=91,
    phases=frozenset({"release"}),
    roles=frozenset({"throttle_angle", "command_mode"}),
    is_model_free=True,
    source="mean of both approaches; production controllers allow 1 deg about the learnt position (P1683)",
    too_high="look for a spring that is hung wrongly or a bent stop of the limp-home lever",
    too_low="look for a spring that is hung wrongly or a bent stop of the limp-home lever",
)
