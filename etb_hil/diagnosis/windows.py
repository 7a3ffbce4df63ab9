"""Newton's law over short windows, in which the angle is never differentiated.

The equation of motion is multiplied by a smooth window and integrated by parts twice, so that the derivatives fall on
the window (the modulating functions of Shinbrot 1957). What is measured and what a model says pass the same window:
its width costs resolution and no bias, where a filtered peak is too low. The torque that
noise of the angle makes falls with the width to the power of 2.5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.compiled import njit
from etb_hil.diagnosis.ticks import TICK, Ticks
from etb_hil.recording.samples import Float64, Int64

STRIDE = 4  # ticks from window to window: finer would repeat what overlapping windows already say
_PRESLIDING = 0.035  # rad after a turn in which bristles bend: the weakest elements of GMS by 5 % at 20 mrad still
_TURNED = 1e-3  # rad back from the farthest angle: a step of a coarse plate track is 0.77 mrad
_JITTER = 0.05  # share of a tick by which the distance of two ticks may be off: more means that samples are missing


@dataclass(frozen=True, slots=True)
class Shape:
    """The shape of a window that reaches `half` ticks to both sides.

    Its weights (2 half + 1) are those of means, torques, rates (1/s) and accelerations (1/s^2). The mean of
    many windows a stride apart has `overlap` times the variance that it had of independent ones.
    """

    half: int
    overlap: float
    mean: Float64
    torque: Float64
    rate: Float64
    acceleration: Float64


def _shape(half: int, overlap: float) -> Shape:
    window = np.zeros(2 * half + 1)
    for j in range(-half + 1, half):
        s = j / half
        window[j + half] = (1.0 - s * s) * (1.0 - s * s) * (1.0 - s * s)
    total = 0.0
    for value in window:
        total += value
    window = window / total
    before, after = np.zeros(len(window)), np.zeros(len(window))
    before[1:], after[:-1] = window[:-1], window[1:]
    # A second difference of angles is the integral of the torque under a triangle: 1/6, 4/6, 1/6 for a torque that is
    # linear between ticks.
    torque = (before + 4.0 * window + after) / 6.0
    rate, acceleration = (before - after) / (2.0 * TICK), (before - 2.0 * window + after) / (TICK * TICK)
    return Shape(half, overlap, window, torque, rate, acceleration)


# 17 ms: short against a dash's rise (75 ms) and fall (45 ms), in which speeds would mix. White noise of the torque
# overlaps 2.5 times in these windows, 4.9 times in those twice as wide.
NARROW = _shape(8, overlap=3.0)
WIDE = _shape(16, overlap=6.0)  # for an angle whose noise counts in narrow windows


@dataclass(frozen=True, slots=True)
class Windows:
    """Windows in order of time: `centre` (m), the index of each one's middle tick."""

    centre: Int64
    shape: Shape = NARROW

    def __len__(self) -> int:
        return len(self.centre)


def place_windows(ticks: Ticks, usable: Int64, shape: Shape = NARROW) -> Windows:
    """Lay windows over the runs of ticks (n) that are usable (1).

    The ticks of a run follow each other without a gap.
    """
    centre = np.empty(len(ticks), np.int64)
    count = _place(ticks.time, usable, shape.half, centre)
    return Windows(centre[:count].copy(), shape)


def sliding(ticks: Ticks, windows: Windows) -> NDArray[np.bool_]:
    """Return which windows (m) slide, by whatever law bristles bend.

    All ticks of such a window are beyond the way that bristles bend over after a turn.
    """
    way = np.empty(len(ticks))
    _way_since_turn(ticks.angle, way)
    bends = np.concatenate(([0], np.cumsum(way < _PRESLIDING)))
    half = windows.shape.half
    return bends[windows.centre + half + 1] == bends[windows.centre - half]


@njit(cache=True, error_model="numpy")
def _way_since_turn(angle: Float64, out: Float64) -> None:
    """Fill out (n) with how far angles (n) are from where the plate last turned."""
    turn = farthest = angle[0] if len(angle) else 0.0
    for k in range(len(angle)):
        side = 1.0 if farthest > turn else -1.0
        if (angle[k] - farthest) * side > 0.0 or farthest == turn:
            farthest = angle[k]
        elif (farthest - angle[k]) * side > _TURNED:
            turn, farthest = farthest, angle[k]
        out[k] = abs(angle[k] - turn)


def share_that_follows(ticks: Ticks) -> float:
    """Return the share of the ticks that come right after another.

    The others stand behind a gap.
    """
    if len(ticks) < 2:
        return 0.0
    follows = np.abs(np.diff(ticks.time) - TICK) < _JITTER * TICK
    return float(np.count_nonzero(follows)) / len(follows)


@njit(cache=True, error_model="numpy")
def _place(time: Float64, usable: Int64, half: int, centre: Int64) -> int:
    count, run, since_last = 0, 0, STRIDE
    for k in range(len(time)):
        follows = k > 0 and abs(time[k] - time[k - 1] - TICK) < _JITTER * TICK
        if usable[k] == 0 or not follows:
            run, since_last = (1 if usable[k] else 0), STRIDE
            continue
        run += 1
        if run > 2 * half:
            since_last += 1
            if since_last >= STRIDE:
                centre[count] = k - half
                count, since_last = count + 1, 0
    return count


@njit(cache=True, error_model="numpy")
def bend(values: Float64, mean: float, single: float, samples: Float64) -> None:
    """Add to values (n), in place, a share of their second difference.

    The share is `mean` at a tick that is the mean of many samples, and `mean + single` at one of a single sample.
    """
    before = values[0]
    for k in range(1, len(values) - 1):
        here = values[k]
        share = mean + single / (samples[k] * samples[k])
        values[k] += share * (before - 2.0 * here + values[k + 1])
        before = here


@njit(cache=True, error_model="numpy")
def windowed(values: Float64, kernel: Float64, centre: Int64, out: Float64) -> None:
    """Fill out (m) with the weighted sums of values (n) about windows' centres (m)."""
    for k in range(len(centre)):
        first = centre[k] - len(kernel) // 2
        total = 0.0
        for j in range(len(kernel)):
            total += kernel[j] * values[first + j]
        out[k] = total


def window_means(values: Float64, kernel: Float64, windows: Windows) -> Float64:
    """Return what a kernel of the windows' shape makes of values (n) in each (m)."""
    out = np.empty(len(windows))
    windowed(values, kernel, windows.centre, out)
    return out
