"""Intervals of fitted numbers: from blocks of the record, since neighbouring residuals are no news, and from a rerun.

Blocks say how a number scatters; what the same bristles and encoder do in every block they do not see. The model's own
simulation, of which the truth is known, does: the error made there is added. A parameter on the bound of its tolerance
may also be somewhat inside, and what moves with it then moves, too.
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
    """Return every unknown of a fit with its interval: a sandwich over blocks, widened by what bounds hold back."""
    missed = _missed(floor)
    count = max(b.measured.angle_noise for b in balances) * np.sqrt(12.0)
    unknowns, fit = calibration.unknowns, calibration.fit
    x = np.array([u.x_of(fit.whole) for u in unknowns])
    at_low = np.array([v <= u.low + 1e-6 for u, v in zip(unknowns, x, strict=True)])
    at_high = np.array([v >= u.high - 1e-6 for u, v in zip(unknowns, x, strict=True)])
    bound = at_low | at_high
    block = segment_of(balances, _BLOCKS)
    spread = _spread(calibration, block, ~bound)
    below, above = np.zeros(len(x)), np.zeros(len(x))
    if bound.any() and not bound.all():
        inward = _inward(calibration, block, bound)
        inward = np.where(at_high, -inward, inward)
        moved = _following(calibration, bound) * inward[bound]
        below[~bound], above[~bound] = np.minimum(moved, 0.0).sum(1), np.maximum(moved, 0.0).sum(1)
        below[bound], above[bound] = np.minimum(inward, 0.0)[bound], np.maximum(inward, 0.0)[bound]
    found = []
    for k, unknown in enumerate(unknowns):
        value = float(fit.whole[unknown.place])
        reach = 0.0 if bound[k] else _Z * float(np.hypot(spread[k] * unknown.scale, missed.get(unknown.name, 0.0)))
        if unknown.place in _PLACES:
            reach = max(reach, count)
        low, high = value - reach + below[k] * unknown.scale, value + reach + above[k] * unknown.scale
        found.append(Estimate(unknown.name, unknown.place, value, low, high, bool(bound[k])))
    return found


def _spread(calibration: Calibration, block: NDArray[np.int64], free: NDArray[np.bool_]) -> Float64:
    """Return the standard deviation of each of the unknowns (n) that are `free`, in its own scale; 0 of the others."""
    spread = np.zeros(len(free))
    if free.any():
        inner, residual = calibration.columns[:, free], calibration.fit.residual
        scores = np.stack([inner[block == k].T @ residual[block == k] for k in range(_BLOCKS)])
        scores -= scores.mean(0)
        half = scores @ np.linalg.pinv(_normal(inner), rcond=1e-13, hermitian=True)
        spread[free] = np.sqrt((half**2).sum(0) * _BLOCKS / (_BLOCKS - 1.0))
    return spread


def _inward(calibration: Calibration, block: NDArray[np.int64], bound: NDArray[np.bool_]) -> Float64:
    """Return how far (n) inside its bound the data still let each unknown be that they would have beyond it.

    That far the likelihood has fallen from the bound by as much as it falls to the end of an interval from its peak.
    """
    columns, unknowns = calibration.columns, calibration.unknowns
    pull = np.linalg.pinv(_normal(columns), rcond=1e-13, hermitian=True) @ (columns.T @ calibration.fit.residual)
    within = _Z * _spread(calibration, block, np.ones(len(bound), bool))
    width = np.array([u.high - u.low for u in unknowns])
    return np.where(bound, np.minimum(np.hypot(pull, within) - np.abs(pull), width), 0.0)


def _following(calibration: Calibration, bound: NDArray[np.bool_]) -> Float64:
    """Return by how much each free unknown (free, bound) moves with one that is held on its bound."""
    normal = _normal(calibration.columns)
    own = np.linalg.pinv(normal[np.ix_(~bound, ~bound)], rcond=1e-13, hermitian=True)
    return np.asarray(-own @ normal[np.ix_(~bound, bound)])


def _normal(columns: Float64) -> Float64:
    return columns.T @ columns + _RIDGE * np.eye(columns.shape[1])


def _missed(floor: Floor) -> dict[str, float]:
    """Return by name how far a rerun's calibration ended from what was simulated."""
    found = floor.calibration.fit.whole
    return {u.name: abs(float(found[u.place] - floor.truth[u.place])) for u in floor.calibration.unknowns}
