"""Break-away friction T_st."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings
    from etb_hil.diagnosis.measurement_kind import Estimate


def _stiction(run: Findings) -> Estimate | None:
    """Return the fitted friction of sliding at no speed.

    Its interval is as wide as an uneven way makes it, and as slower motion may hide.
    """
    found = run.fitted.get("T_st")
    if found is None:
        return None
    whole = run.widening.of_stiction(found)
    return run.with_gain(whole, may_pass=run.unseen is None, undecided=run.hides_stiction)


MEASUREMENT = MeasurementKind(
    id="T_st",
    name="break-away friction",
    unit="N·m",
    compute=_stiction,
    order=10,
    is_friction=True,
    source="seed paper, eq. (2) at zero speed",
)
