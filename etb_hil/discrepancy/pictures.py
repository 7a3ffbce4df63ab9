"""What the report draws: traces before and after, and what is left over the coordinates in which it shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy import freerun
from etb_hil.discrepancy.findings import Findings
from etb_hil.discrepancy.leftover import Leftover, leftovers
from etb_hil.plant.effects.layout import EXTENDED

Float64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Pictures:
    """Columns for the plots, SI: one free-run segment, and what balances have left."""

    time: Float64
    measured: Float64
    before: Float64
    after: Float64
    position_unit: str
    left: list[Leftover]


def pictures(findings: Findings, segments: dict[str, dict[str, Float64]]) -> Pictures:
    """Return the columns; the segment is the one that the calibrated model gets most wrong."""
    b = max(findings.balances, key=lambda each: each.rows)
    m = b.measured
    worst = int(np.argmax(segments["calibrated"][freerun.POSITION]))
    rows = round(freerun.SEGMENT_S * m.rate)
    begin = worst * rows
    first, last = findings.calibration.fit.whole, findings.final.fit.whole
    return Pictures(
        time=np.arange(begin, begin + rows) / m.rate,
        measured=m.angle[begin : begin + rows],
        before=freerun.trace(b, first[:EXTENDED], begin),
        after=freerun.trace(b, last[:EXTENDED], begin),
        position_unit="m" if m.is_drive else "rad",
        left=leftovers(b, first, last),
    )
