"""How well the plate finds its limp-home position, approached from both sides."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind
from etb_hil.diagnosis.motion.encoder import step_of
from etb_hil.diagnosis.motion.returns import not_at_rest, returns

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _compute(run: Findings) -> Estimate | None:
    found = returns(run)
    if len({one.is_opening for one in found}) < 2:
        return None
    if (instead := not_at_rest(found)) is not None:
        return instead
    rests = [one.rest for one in found]
    value, step = max(rests) - min(rests), step_of(run)
    # Two angles are each rounded by up to half a step. Their difference is off by up to a step, with a triangular
    # distribution (JCGM 100:2008, 4.3.9), 95 % of which lie within 1 - sqrt(0.05) of a step.
    reach = (1.0 - math.sqrt(0.05)) * step
    return Estimate(value, max(value - reach, 0.0), value + reach, f"of {len(found)} returns, by the encoder")


MEASUREMENT = MeasurementKind(
    id="default_position_spread",
    name="spread of the limp-home position",
    unit="rad",
    compute=_compute,
    order=92,
    phases=frozenset({"release"}),
    roles=frozenset({"command_mode"}),
    is_model_free=True,
    source="largest less smallest rest, approached from both sides (range of ISO 230-2, bidirectional)",
    too_high="look for a plate or a gear that sticks near the limp-home position",
)
