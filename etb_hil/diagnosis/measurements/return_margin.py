"""Return margin: the weaker spring's preload less break-away friction."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings
    from etb_hil.diagnosis.measurement_kind import Estimate


def _margin(run: Findings) -> Estimate | None:
    """Return what the weaker spring's preload has over T_st."""
    found, stiction = run.fitted.get("return_margin"), run.stiction
    if found is None or stiction is None:
        return None
    holds = "; friction holds the plate against its springs" if found.value <= 0.0 else ""
    margin = run.widening.of_margin(found, stiction.value)
    return replace(run.of_stiction(replace(margin, low=margin.low - run.above_curve)), if_failed=holds)


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
