"""Most slow friction along the way."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _friction_most(run: Findings) -> Estimate | None:
    """Return the highest slow friction along the way.

    None where friction does not differ along the way.
    """
    if run.way is None:
        return None
    place = run.way.most
    return Estimate(place.torque, note=f"{place.excess:+.1%} off the curve")


MEASUREMENT = MeasurementKind(
    id="friction_most",
    name="most slow friction along the way",
    unit="N·m",
    compute=_friction_most,
    order=320,
    has_interval=False,
)
