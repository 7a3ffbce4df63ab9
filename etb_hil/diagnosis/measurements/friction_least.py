"""Least slow friction along the way."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _friction_least(run: Findings) -> Estimate | None:
    """Return the lowest slow friction along the way.

    None where friction does not differ along the way.
    """
    if run.way is None:
        return None
    place = run.way.least
    return Estimate(place.torque, note=f"{place.excess:+.1%} off the curve")


MEASUREMENT = MeasurementKind(
    id="friction_least",
    name="least slow friction along the way",
    unit="N·m",
    compute=_friction_least,
    order=300,
    has_interval=False,
)
