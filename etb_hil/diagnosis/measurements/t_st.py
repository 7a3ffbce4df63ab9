"""Break-away friction T_st."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from etb_hil.diagnosis.interval import Interval
from etb_hil.diagnosis.measurement_kind import MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings
    from etb_hil.diagnosis.measurement_kind import Estimate

_AT_LEAST = "at least: so much broke the plate away, more than its curve has; in slower motion it may be more"


def _stiction(run: Findings) -> Estimate | None:
    """Return the fitted friction of sliding at no speed.

    Its interval is as wide as an uneven way makes it, and has what slower motion may hide and break-aways show. It is
    not less than those took. Where one contradicts the curve, T_st is what that took, at least.
    """
    found, hard = run.stiction, run.hard_break_away
    if found is None or hard is None:
        return None if found is None else run.of_stiction(found)
    broke = run.widening.of_stiction(hard.least)  # of one place and time
    least = max(found.low, broke.low)
    if hard.reason is not None:
        return replace(run.of_stiction(replace(broke, low=least)), note=_AT_LEAST, is_least=True)
    return run.of_stiction(Interval(max(found.value, least), least, found.high + hard.above))


MEASUREMENT = MeasurementKind(
    id="T_st",
    name="break-away friction",
    unit="N·m",
    compute=_stiction,
    order=10,
    is_friction=True,
    source="seed paper, eq. (2) at zero speed",
)
