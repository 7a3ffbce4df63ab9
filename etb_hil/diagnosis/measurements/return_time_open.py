"""How long springs take to bring the plate back from wide open.

The bridge is off meanwhile.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind
from etb_hil.diagnosis.motion.returns import return_time

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _compute(run: Findings) -> Estimate | None:
    return return_time(run, is_opening=False)


MEASUREMENT = MeasurementKind(
    id="return_time_open",
    name="unpowered return time from wide open",
    unit="s",
    compute=_compute,
    order=93,
    phases=frozenset({"release"}),
    roles=frozenset({"command_mode"}),
    is_model_free=True,
    source="49 CFR 571.124 (FMVSS 124), S5.3; a supplier's sheet: below 500 ms at -40 degC",
    too_high="look for friction that is too high or a spring that is weak or broken",
)
