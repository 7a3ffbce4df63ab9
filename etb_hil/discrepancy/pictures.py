"""What the report draws: traces before and after, and the torque that is left over the angle, by direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy import freerun
from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.naming import Findings
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import STRIBECK_VELOCITY, Vector

Float64 = NDArray[np.float64]

_BINS = 40
_FEWEST = 5
_MOVING = 0.01  # of omega_s


@dataclass(frozen=True, slots=True)
class Pictures:
    """Columns for the plots, SI: one free-run segment, and means of the torque balance by angle and direction."""

    time: Float64
    measured: Float64
    before: Float64
    after: Float64
    angle: Float64
    opening: tuple[Float64, Float64]  # before, after
    closing: tuple[Float64, Float64]
    position_unit: str
    load_unit: str


def pictures(findings: Findings, segments: dict[str, dict[str, Float64]]) -> Pictures:
    """Return the columns; the segment is the one that the calibrated model gets most wrong."""
    b = max(findings.balances, key=lambda each: each.rows)
    m = b.measured
    worst = int(np.argmax(segments["calibrated"][freerun.POSITION]))
    rows = round(freerun.SEGMENT_S * m.rate)
    begin = worst * rows
    first, last = findings.calibration.fit.whole, findings.final.fit.whole
    part = slice(begin, begin + rows)
    edges = np.linspace(float(m.angle.min()), float(m.angle.max()), _BINS + 1)
    opening, closing = [], []
    for whole in (first, last):
        by_direction = _by_direction(b, whole, edges)
        opening.append(by_direction[0])
        closing.append(by_direction[1])
    return Pictures(
        time=np.arange(begin, begin + rows) / m.rate,
        measured=m.angle[part],
        before=freerun.trace(b, first[:EXTENDED], begin),
        after=freerun.trace(b, last[:EXTENDED], begin),
        angle=0.5 * (edges[1:] + edges[:-1]),
        opening=(opening[0], opening[1]),
        closing=(closing[0], closing[1]),
        position_unit="m" if m.is_drive else "rad",
        load_unit="N" if m.is_drive else "N·m",
    )


def _by_direction(b: Balances, whole: Vector, edges: Float64) -> list[Float64]:
    left = b.channels(whole[:EXTENDED], whole[EXTENDED:])[0] / float(b.whitening(0)[0])
    angle, velocity = b.motion(whole[:EXTENDED])
    spectrum = b.spectrum
    place = np.clip(np.digitize(spectrum.picked(angle), edges) - 1, 0, len(edges) - 2)
    speed = spectrum.picked(velocity)
    least = _MOVING * whole[STRIBECK_VELOCITY]
    found = []
    for moving in (speed > least, speed < -least):
        good = moving & b.regimes.is_good & ~b.regimes.is_stuck
        count = np.bincount(place[good], minlength=len(edges) - 1)
        total = np.bincount(place[good], left[good], len(edges) - 1)
        with np.errstate(invalid="ignore", divide="ignore"):
            found.append(np.where(count >= _FEWEST, total / count, np.nan))
    return found
