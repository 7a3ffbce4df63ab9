"""Break-away friction T_st."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings
    from etb_hil.diagnosis.measurement_kind import Estimate


def _stiction(run: Findings) -> Estimate | None:
    """Return the fitted friction of sliding at no speed.

    Its interval is as wide as an uneven way makes it, and has what slower motion may hide and break-aways show.
    """
    found = run.stiction
    return None if found is None else run.of_stiction(replace(found, high=found.high + run.above_curve))


MEASUREMENT = MeasurementKind(
    id="T_st",
    name="break-away friction",
    unit="N·m",
    compute=_stiction,
    order=10,
    is_friction=True,
    source="seed paper, eq. (2) at zero speed",
)
