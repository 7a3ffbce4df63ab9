"""Return margin: the weaker spring's preload less break-away friction."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from etb_hil.diagnosis.interval import Interval
from etb_hil.diagnosis.measurement_kind import MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings
    from etb_hil.diagnosis.measurement_kind import Estimate

_AT_MOST = "at most its upper end: the plate broke away above its curve; in slower motion it may be less"


def _margin(run: Findings) -> Estimate | None:
    """Return what the weaker spring's preload has over T_st.

    By as much as break-aways raise T_st above the curve's, the margin is less.
    """
    found, curve, stiction = run.fitted.get("return_margin"), run.stiction, run.bounded_stiction
    if found is None or curve is None or stiction is None:
        return None
    margin = run.widening.of_margin(found, curve.value)
    value = margin.value - (stiction.value - curve.value)
    low, high = margin.low - (stiction.high - curve.high), margin.high - (stiction.low - curve.low)
    holds = "; friction holds the plate against its springs" if value <= 0.0 else ""
    estimate = run.of_stiction(Interval(value, min(low, value), max(high, value)))
    return replace(estimate, if_failed=holds, note=_AT_MOST if run.is_stiction_least else "")


MEASUREMENT = MeasurementKind(
    id="return_margin",
    name="return margin",
    unit="N·m",
    compute=_margin,
    order=30,
    friction_of="T_st",
    least_limit=0.0,
    too_low="Do not fit this unit to a vehicle: its plate may stay open without power. Replace the throttle body.",
    source="preload less T_st at the plate; at zero the plate does not return",
)
