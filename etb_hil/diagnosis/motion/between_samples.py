"""Where a signal passes a level, and how high it comes, between samples.

Between samples the signal is a cubic spline: a controller steps its voltage at the samples, an inductance keeps the
current, and with it the acceleration of an angle, continuous. A parabola through the same samples misses the jumps of
the third derivative, which are 3 us of a rise of 6 ms at 1 kHz.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from etb_hil.recording.samples import Float64

_NEAR = 6  # samples on each side: what lies beyond bends a spline by less than (2 - sqrt(3))^5, a thousandth
_FINE = np.linspace(0.0, 1.0, 65)  # of a sample: a peak lies at most an eighth of 1/64^2 of the bend above


def crossing(time: Float64, value: Float64, level: float, index: int) -> float:
    """Return when a signal passed a level between samples `index - 1` and `index`."""
    low, high = float(value[index - 1]), float(value[index])
    start, step = float(time[index - 1]), float(time[index] - time[index - 1])
    if high == low:
        return start + step
    between = _between(time, value, index)
    passed = between >= level if low < high else between <= level
    at = int(np.argmax(passed))
    if at == 0:
        return start if passed[0] else start + step
    share = (level - float(between[at - 1])) / float(between[at] - between[at - 1])
    return start + float(_FINE[at - 1] + share * (_FINE[at] - _FINE[at - 1])) * step


def highest(time: Float64, value: Float64, first: int) -> float:
    """Return how high a signal comes from sample `first` on."""
    peak = first + int(np.argmax(value[first:]))
    sides = [index for index in (peak, peak + 1) if first < index < len(value)]
    return max([float(value[peak]), *(float(np.max(_between(time, value, index))) for index in sides)])


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
    """Return the second derivatives of the natural cubic spline through samples (de Boor 1978, chapter IV)."""
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
