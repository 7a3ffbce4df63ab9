"""Winding resistance of the run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _resistance(run: Findings) -> Estimate | None:
    """Return the winding resistance that voltage, current and speed agree on."""
    balance = run.assessment.balance
    if balance is None:
        return None
    reach = TWO_SIDED_95 * balance.resistance_error
    return Estimate(balance.resistance, balance.resistance - reach, balance.resistance + reach)


MEASUREMENT = MeasurementKind(
    id="resistance",
    name="winding resistance in motion",
    unit="ohm",
    compute=_resistance,
    order=160,
    roles=frozenset({"motor_voltage"}),
    is_model_free=True,
    source="seed paper, eq. (1), first line",
)
