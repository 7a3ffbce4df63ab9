"""Place of the least slow friction along the way."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _friction_least_at(run: Findings) -> Estimate | None:
    """Return the angle of the lowest slow friction along the way.

    None where friction does not differ along the way.
    """
    if run.way is None:
        return None
    place = run.way.least
    return Estimate(place.angle)


MEASUREMENT = MeasurementKind(
    id="friction_least_at",
    name="place of the least slow friction along the way",
    unit="rad",
    compute=_friction_least_at,
    order=310,
    has_interval=False,
)
