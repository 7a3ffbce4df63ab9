"""Intervals of fitted numbers: from blocks of the record, since neighbouring residuals are no news, and from a rerun.

Blocks say how a number scatters; what the same bristles and encoder do in every block they do not see. The model's own
simulation, of which the truth is known, does: no interval is narrower than the error made there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.calibration import Calibration
from etb_hil.discrepancy.floor import Floor
from etb_hil.discrepancy.segments import segment_of
from etb_hil.plant.physics import LIMP_HOME, STOP_HIGH, STOP_LOW

Float64 = NDArray[np.float64]

_BLOCKS = 40
_Z = 2.02  # Student's 97.5 % of 40 blocks
_RIDGE = 1e-3
_PLACES = (LIMP_HOME, STOP_LOW, STOP_HIGH)  # known to no less than an encoder's count: who says where in it zero is


@dataclass(frozen=True, slots=True)
class Estimate:
    """A fitted number with its 95 % interval, SI."""

    name: str
    place: int
    value: float
    low: float
    high: float
    on_bound: bool


def estimates(calibration: Calibration, balances: Sequence[Balances], floor: Floor) -> list[Estimate]:
    """Return every unknown of a fit with its interval: a sandwich over blocks; what lies on a bound is held there."""
    missed = _missed(floor)
    count = max(b.measured.angle_noise for b in balances) * np.sqrt(12.0)
    unknowns, fit, columns = calibration.unknowns, calibration.fit, calibration.columns
    x = np.array([u.x_of(fit.whole) for u in unknowns])
    bound = np.array([v <= u.low + 1e-6 or v >= u.high - 1e-6 for u, v in zip(unknowns, x, strict=True)])
    free = np.flatnonzero(~bound)
    spread = np.zeros(len(x))
    if len(free):
        inner = columns[:, free]
        normal = inner.T @ inner + _RIDGE * np.eye(len(free))
        block = segment_of(balances, _BLOCKS)
        scores = np.stack([inner[block == k].T @ fit.residual[block == k] for k in range(_BLOCKS)])
        scores -= scores.mean(0)
        inverse = np.linalg.pinv(normal, rcond=1e-13, hermitian=True)
        half = scores @ inverse
        spread[free] = np.sqrt((half**2).sum(0) * _BLOCKS / (_BLOCKS - 1.0))
    found = []
    for k, unknown in enumerate(unknowns):
        value = float(fit.whole[unknown.place])
        reach = _Z * max(spread[k] * unknown.scale, 0.0 if bound[k] else missed.get(unknown.name, 0.0))
        if unknown.place in _PLACES:
            reach = max(reach, count)
        found.append(Estimate(unknown.name, unknown.place, value, value - reach, value + reach, bool(bound[k])))
    return found


def _missed(floor: Floor) -> dict[str, float]:
    """Return by name how far a rerun's calibration ended from what was simulated."""
    found = floor.calibration.fit.whole
    return {u.name: abs(float(found[u.place] - floor.truth[u.place])) for u in floor.calibration.unknowns}
