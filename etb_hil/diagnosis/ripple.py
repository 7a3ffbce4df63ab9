"""Friction that repeats within a degree.

Passes over the same places share it; they share no noise.

Windows in a cell scatter by it as they do by noise, so no scatter distinguishes the two. What two passes the same way
have in common at the same place does: noise has nothing in common with itself.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etb_hil.recording.samples import Float64

# Thresholds on what comes out are those of `uneven_way.py`.
_STEP = 0.002  # rad: what a window of 17 ms passes at 0.1 rad/s
_REACH = 8  # steps on either side, whose mean is taken off: what changes over more than that, cells show
_WIDEST = 0.012  # rad between windows of a pass: more than that at up to 2 rad/s means that some are left out


def pass_of(velocity: Float64) -> NDArray[np.int64]:
    """Return which pass each window (m) belongs to, in order of time.

    `velocity` (m) rad/s changes its sign from pass to pass.
    """
    number: NDArray[np.int64] = np.cumsum(np.concatenate(([False], (velocity[1:] > 0.0) != (velocity[:-1] > 0.0))))
    return number


def shared_by_passes(
    position: Float64, velocity: Float64, number: NDArray[np.int64], values: Float64
) -> tuple[float, float]:
    """Return the variance that passes share at the same places, and the whole one.

    The passes are those that go the same way. Both results are 0 where no two of them share a place. `position` rad,
    `velocity` rad/s, the pass's `number` and the `values` are those of windows (m), in order of time.
    """
    if not len(position):
        return 0.0, 0.0
    first = int(np.floor(position.min() / _STEP))
    steps = int(np.ceil(position.max() / _STEP)) - first + 1
    count, total, square = np.zeros((2, steps)), np.zeros((2, steps)), np.zeros((2, steps))
    for one in np.split(np.arange(len(number)), np.flatnonzero(np.diff(number)) + 1):
        order = one[np.argsort(position[one], kind="stable")]
        begin, fine = _levelled(position[order], values[order])
        known = np.isfinite(fine)
        at = begin - first + np.flatnonzero(known)
        way = 0 if velocity[one[0]] > 0.0 else 1
        count[way, at] += 1.0
        total[way, at] += fine[known]
        square[way, at] += fine[known] * fine[known]
    pairs = float(np.sum(count * (count - 1.0)))
    if pairs == 0.0:
        return 0.0, 0.0
    return float(np.sum(total * total - square)) / pairs, float(np.sum(square * np.maximum(count - 1.0, 0.0))) / pairs


def _levelled(position: Float64, values: Float64) -> tuple[int, Float64]:
    """Return the first step that a pass crosses, and its values less their mean.

    The values are taken from step to step; the mean is that around each. They are NaN in gaps. `position` (m) rad is in
    ascending order.
    """
    begin = int(np.ceil(position[0] / _STEP))
    grid = np.arange(begin, int(np.floor(position[-1] / _STEP)) + 1) * _STEP
    if len(grid) <= 2 * _REACH or len(position) < 2:
        return begin, np.full(len(grid), np.nan)
    after = np.clip(np.searchsorted(position, grid), 1, len(position) - 1)
    known = position[after] - position[after - 1] < _WIDEST
    level = np.where(known, np.interp(grid, position, values), 0.0)
    low = np.maximum(np.arange(len(grid)) - _REACH, 0)
    high = np.minimum(np.arange(len(grid)) + _REACH + 1, len(grid))
    sums, counts = (np.concatenate(([0.0], np.cumsum(part))) for part in (level, known.astype(np.float64)))
    around = (sums[high] - sums[low]) / np.maximum(counts[high] - counts[low], 1.0)
    return begin, np.where(known, level - around, np.nan)
