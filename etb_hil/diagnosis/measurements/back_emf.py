"""Back-EMF constant at the plate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings


def _back_emf(run: Findings) -> Estimate | None:
    """Return the constant that voltage, current and speed agree on."""
    balance = run.assessment.balance
    if balance is None:
        return None
    reach = TWO_SIDED_95 * balance.back_emf_error
    return Estimate(balance.back_emf, balance.back_emf - reach, balance.back_emf + reach)


MEASUREMENT = MeasurementKind(
    id="back_emf",
    name="back-EMF constant at the plate",
    unit="V·s/rad",
    compute=_back_emf,
    order=150,
    roles=frozenset({"motor_voltage"}),
    is_model_free=True,
    source="seed paper, eq. (1), first line",
)
