"""Break-away friction T_st."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import MeasurementKind

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings
    from etb_hil.diagnosis.measurement_kind import Estimate

_AT_LEAST = "at least its lower end: the plate broke away at this, above its curve; in slower motion it may be more"


def _stiction(run: Findings) -> Estimate | None:
    """Return the fitted friction of sliding at no speed.

    Its interval is as wide as an uneven way makes it, and has what slower motion may hide and break-aways show. It is
    not less than those took. Where one contradicts the curve, T_st is what that took, at least.
    """
    found = run.bounded_stiction
    if found is None:
        return None
    is_least = run.is_stiction_least
    return replace(run.of_stiction(found), note=_AT_LEAST if is_least else "", is_least=is_least)


MEASUREMENT = MeasurementKind(
    id="T_st",
    name="break-away friction",
    unit="N·m",
    compute=_stiction,
    order=10,
    is_friction=True,
    source="seed paper, eq. (2) at zero speed",
)
