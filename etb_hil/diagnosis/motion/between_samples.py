"""Levels and peaks of a signal between its samples.

They tell when it is first and last above a level, and how high it comes.

Between samples the signal is a cubic spline: a controller steps its voltage at the samples, an inductance keeps the
current, and with it the acceleration of an angle, continuous. A parabola through the same samples misses the jumps of
the third derivative, which are 3 us of a rise of 6 ms at 1 kHz. The spline is made here:
scipy's would add 0.3 s of import to every command that judges.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from etb_hil.recording.samples import Float64, Int64

_NEAR = 6  # samples on each side: what lies beyond bends a spline by less than (2 - sqrt(3))^5, a thousandth
_FINE = np.linspace(0.0, 1.0, 65)  # of a sample: a peak lies at most an eighth of 1/64^2 of the bend above


def first_above(time: Float64, value: Float64, level: float, first: int) -> float | None:
    """Return when a signal reaches a level from sample `first` on.

    None where it never does.
    """
    for index in _near(value, level, first):
        when, course = _around(time, value, int(index))
        above = np.flatnonzero(course >= level)
        if len(above):
            at = int(above[0])
            return float(when[0]) if at == 0 else _passed(when, course, level, at)
    return None


def last_above(time: Float64, value: Float64, level: float, first: int) -> float | None:
    """Return until when a signal is above a level, from sample `first` on.

    None where it never is.
    """
    for index in _near(value, level, first)[::-1]:
        when, course = _around(time, value, int(index))
        above = np.flatnonzero(course > level)
        if len(above):
            at = int(above[-1]) + 1
            return float(when[-1]) if at == len(when) else _passed(when, course, level, at)
    return None


def highest(time: Float64, value: Float64, first: int) -> float:
    """Return how high a signal comes from sample `first` on."""
    peak = first + int(np.argmax(value[first:]))
    sides = [index for index in (peak, peak + 1) if first < index < len(value)]
    return max([float(value[peak]), *(float(np.max(_between(time, value, index))) for index in sides)])


def _near(value: Float64, level: float, first: int) -> Int64:
    """Return the samples from `first` on that are above a level.

    Samples that are peaks, and between which the spline may exceed the level, are among them.

    The parabola through a largest sample and its neighbours rises above it by a sixteenth of the second difference at
    most; twice that is allowed to the spline.
    """
    near = value >= level
    bend = 2.0 * value[1:-1] - value[:-2] - value[2:]
    is_peak = (value[1:-1] >= value[:-2]) & (value[1:-1] >= value[2:])
    near[1:-1] |= is_peak & (value[1:-1] + bend / 8.0 >= level)
    return first + np.flatnonzero(near[first:])


def _around(time: Float64, value: Float64, index: int) -> tuple[Float64, Float64]:
    """Return the spline between both neighbours of sample `index`, finely.

    Times come first.
    """
    sides = [side for side in (index, index + 1) if 0 < side < len(value)]
    when = [time[side - 1] + _FINE * (time[side] - time[side - 1]) for side in sides]
    return np.concatenate(when), np.concatenate([_between(time, value, side) for side in sides])


def _passed(when: Float64, course: Float64, level: float, at: int) -> float:
    """Return when the line between two points, `at - 1` and `at`, passes a level."""
    low, high = float(course[at - 1]), float(course[at])
    share = 1.0 if high == low else (level - low) / (high - low)
    return float(when[at - 1] + share * (when[at] - when[at - 1]))


def _between(time: Float64, value: Float64, index: int) -> Float64:
    """Return the spline from sample `index - 1` to `index`, at `_FINE`."""
    begin, end = max(index - _NEAR, 0), min(index + _NEAR, len(value))
    bends = _second_derivatives(time[begin:end].tolist(), value[begin:end].tolist())
    step = float(time[index] - time[index - 1])
    first, second = (step * step / 6.0 * bend for bend in bends[index - 1 - begin : index + 1 - begin])
    rise = float(value[index] - value[index - 1])
    found: Float64 = value[index - 1] + _FINE * rise
    found -= _FINE * (1.0 - _FINE) * (first * (2.0 - _FINE) + second * (1.0 + _FINE))
    return found


def _second_derivatives(time: list[float], value: list[float]) -> list[float]:
    """Return the second derivatives of the natural cubic spline through samples.

    They are those at the samples (de Boor 1978, chapter IV).
    """
    steps = [b - a for a, b in pairwise(time)]
    slopes = [(b - a) / step for (a, b), step in zip(pairwise(value), steps, strict=True)]
    upper, found = [0.0], [0.0]
    for (before, after), (slope, next_slope) in zip(pairwise(steps), pairwise(slopes), strict=True):
        pivot = 2.0 * (before + after) - before * upper[-1]
        found.append((6.0 * (next_slope - slope) - before * found[-1]) / pivot)
        upper.append(after / pivot)
    found.append(0.0)
    for k in range(len(found) - 2, 0, -1):
        found[k] -= upper[k] * found[k + 1]
    return found
