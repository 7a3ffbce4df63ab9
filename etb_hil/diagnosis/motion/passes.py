"""Slow passes up and down at one speed.

What differs by direction cancels in their mean.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from etb_hil.diagnosis.friction_model import LOG_STIFFNESS
from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.motion.commands import reports
from etb_hil.diagnosis.segments import Segment
from etb_hil.plant.exactmath import exp
from etb_hil.recording.samples import Float64, Int64

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings

SLOW = 1.0  # rad/s, the highest speed of a slow pass
_SAME = 0.1  # share by which the speeds of passes may differ: friction and springs do not distinguish them
_SETTLE_S = 0.1  # after the set-point's speed became steady: the loop has settled
_TURNED = 8.0  # factors e: 0.03 % is left, which of the stock unit is 0.06 mN·m and a fifth of the noise of a bin
_FEWEST = 10  # commands of a pass without its ends: its speed is known to a percent


@dataclass(frozen=True, slots=True)
class Bins:
    """Means over equal bins of angle, opening and closing (2, m).

    The bins are those that both passes met. `angle` is in rad, `value` in its own unit; `error` is the standard error
    of each mean.
    """

    angle: Float64
    value: Float64
    error: Float64

    def __len__(self) -> int:
        return self.angle.shape[1]


def slow_passes(segments: Sequence[Segment], value: str, width: float, presliding: float = 0.0) -> Bins:
    """Return the means of a column over bins of angle, from slow passes.

    The bins have a `width` in rad. Each mean is from the slowest steady passes that met its bin. Of each pass, the
    first `presliding` rad are left out: friction, or the lag of a sensor, turns round there.
    """
    parts = (part for segment in segments for part in _passes(segment, value, presliding))
    found = sorted(parts, key=lambda part: abs(part[0]))
    both: dict[int, list[tuple[float, float, float]]] = {}
    while found:
        same = [part for part in found if abs(part[0]) <= abs(found[0][0]) * (1.0 + _SAME)]
        sides = [_binned([(a, v) for speed, a, v in same if sign * speed > 0.0], width) for sign in (1.0, -1.0)]
        for key in sides[0].keys() & sides[1].keys():
            both.setdefault(key, [side[key] for side in sides])
        found = found[len(same) :]
    table = np.array([both[key] for key in sorted(both)]).reshape(len(both), 2, 3)
    return Bins(table[:, :, 0].T, table[:, :, 1].T, table[:, :, 2].T)


def presliding(run: Findings) -> float:
    """Return the way in rad over which friction turns round to a three-thousandth.

    Friction approaches its steady value by a factor e over the way T_st / sigma_0 (seed paper, eq. (2)). Both are those
    of the fit, within their intervals; without a fit, the bristles are the softest of the model.
    """
    model, fit, stiction = run.model, run.assessment.fit, run.fitted.get("T_st")
    if fit is None or stiction is None:
        softest = model.values.bristle_stiffness - model.tolerance("bristle_stiffness")
        return _TURNED * model.values.stiction / softest
    softest = float(exp(fit.parameters[LOG_STIFFNESS] - TWO_SIDED_95 * fit.error({LOG_STIFFNESS: 1.0})))
    return _TURNED * stiction.high / softest


def _passes(segment: Segment, value: str, presliding: float) -> list[tuple[float, Float64, Float64]]:
    """Return the slow passes of a segment: speed in rad/s, angles and values.

    In each, the set-point moved at one slow speed.
    """
    position = segment.column("command_position")
    fresh = np.zeros(len(position), bool)
    how = reports(segment)
    fresh[how.first] = True
    fresh &= np.isfinite(segment.column("angle")) & np.isfinite(segment.column(value))
    found = []
    for speed, start, end in _steady(segment.time, position, how.period):
        if abs(speed) <= SLOW:
            begin = start + max(_SETTLE_S, presliding / abs(speed))
            taken = fresh & (segment.time > begin) & (segment.time < end)
            found.append((speed, segment.column("angle")[taken], segment.column(value)[taken]))
    return found


def _steady(time: Float64, position: Float64, period: float) -> Iterator[tuple[float, float, float]]:
    """Yield the segments in which the set-point follows a straight line.

    Each has its speed in rad/s, its begin and its end in s. The set-point is a staircase of commands that come late,
    are rounded, and are seen up to a `period` s after they came. A single step tells a speed badly; the line through a
    whole segment tells it well.
    """
    at: Int64 = np.flatnonzero(np.abs(np.diff(position)) > 0.0) + 1
    if len(at) < _FEWEST:
        return
    when, where = time[at], position[at]
    wide = float(np.median(np.diff(when))) + period
    high = float(np.min(np.abs(where - position[at - 1])))
    taken = np.zeros(len(at), bool)
    for piece in sorted(_straight(when.tolist(), where.tolist(), wide, high), key=lambda ends: ends[0] - ends[1]):
        begin, end = piece
        for _ in range(2):  # with the speed of the part, then with that of all which lies on its line
            inside = ~taken & (when >= when[begin] + _SETTLE_S) & (when <= when[end - 1] - _SETTLE_S)
            if np.count_nonzero(inside) < _FEWEST:
                break
            speed, away = _line(when, where, inside)
            off = np.flatnonzero((away > abs(speed) * wide + high) | taken)
            middle = (begin + end) // 2
            begin = int(np.max(off[off < middle], initial=-1)) + 1
            end = int(np.min(off[off >= middle], initial=len(at)))
        else:
            taken[begin:end] = True
            # Soft ends lie within a stair of the line as well, but farther from it than commands scatter.
            scatter = 2.0 * float(np.sqrt(np.mean(away[inside] * away[inside])))
            on_line = when[begin:end][away[begin:end] <= max(scatter, abs(speed) * period + high)]
            if len(on_line):
                yield speed, float(on_line[0]), float(on_line[-1])


def _line(when: Float64, where: Float64, inside: NDArray[np.bool_]) -> tuple[float, Float64]:
    """Return the slope of the line through the commands inside.

    The second result is how far every command is away from that line.
    """
    middle = float(np.mean(when[inside])), float(np.mean(where[inside]))
    since = when - middle[0]
    speed = float(np.sum(since[inside] * (where[inside] - middle[1])) / np.sum(since[inside] * since[inside]))
    return speed, np.abs(where - middle[1] - speed * since)


def _straight(when: list[float], where: list[float], wide: float, high: float) -> Iterator[tuple[int, int]]:
    """Yield the segments of commands that lie within a stair of a straight line.

    Each has its first command, which the line goes through, and its end. A stair is `wide` s, the usual time between
    two commands and that between two samples, and `high` rad. A set-point that stands still for longer than two stairs
    ends a segment, and so does one that turns round.
    """
    begin = 0
    slowest, quickest = 0.0, math.inf
    for k in range(1, len(when)):
        way = 1.0 if where[begin + 1] > where[begin] else -1.0
        passed, far = when[k] - when[begin], way * (where[k] - where[begin])
        slowest = max(slowest, (far - high) / (passed + wide))
        quickest = min(quickest, (far + high) / (passed - wide) if passed > wide else math.inf)
        turns = way * (where[k] - where[k - 1]) < 0.0
        if turns or slowest > quickest or when[k] - when[k - 1] > 2.0 * wide:
            yield begin, k
            begin, slowest, quickest = k - 1 if turns else k, 0.0, math.inf
    yield begin, len(when)


def _binned(parts: list[tuple[Float64, Float64]], width: float) -> dict[int, tuple[float, float, float]]:
    """Return mean angle, mean value and its standard error by the number of the bin.

    The noise is that of all bins together: a few samples tell their own badly. A bin that a pass has just touched, with
    less than half of the usual samples, is left out.
    """
    angle = np.concatenate([np.empty(0), *(a for a, _ in parts)])
    value = np.concatenate([np.empty(0), *(v for _, v in parts)])
    if not len(angle):
        return {}
    numbers = np.floor(angle / width).astype(np.int64)
    keys, place, count = np.unique(numbers, return_inverse=True, return_counts=True)
    mean = np.bincount(place, value) / count
    apart = value - mean[place]
    noise = float(np.sqrt(np.sum(apart * apart) / max(len(value) - len(keys), 1)))
    enough = (count >= 3) & (count >= 0.5 * np.median(count))
    rows = zip(keys, np.bincount(place, angle) / count, mean, noise / np.sqrt(count), strict=True)
    return {
        int(key): (float(a), float(v), float(e)) for (key, a, v, e), is_in in zip(rows, enough, strict=True) if is_in
    }
