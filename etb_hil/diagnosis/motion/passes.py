"""Slow passes over the way at one speed, up and down: what differs by direction cancels in their mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.diagnosis.motion.commands import reports
from etb_hil.diagnosis.segments import Segment
from etb_hil.recording.samples import Float64, Int64

SLOW = 1.0  # rad/s, the highest speed of a slow pass
_SAME = 0.03  # share by which a speed may differ and still be the same
_SETTLE_S = 0.06  # after the set-point's speed became steady: bristles have turned round, the loop has settled


@dataclass(frozen=True, slots=True)
class Bins:
    """Means over equal bins of angle, opening and closing (2, m), of bins that both passes met.

    `angle` rad; `value` in its own unit; `error`, the standard error of each mean.
    """

    angle: Float64
    value: Float64
    error: Float64

    def __len__(self) -> int:
        return self.angle.shape[1]


def slow_passes(segments: Sequence[Segment], value: str, width: float) -> Bins:
    """Return the means of a column over bins of `width` rad, from the slowest steady passes of the segments."""
    found = [part for segment in segments for part in _passes(segment, value)]
    if not found:
        return Bins(*(np.empty((2, 0)) for _ in range(3)))
    slowest = min(abs(speed) for speed, _, _ in found)
    sides = []
    for sign in (1.0, -1.0):
        parts = [(a, v) for speed, a, v in found if 0.0 < sign * speed <= slowest * (1.0 + _SAME)]
        sides.append(_binned(parts, width))
    both = sorted(sides[0].keys() & sides[1].keys())
    table = np.array([[side[key] for key in both] for side in sides]).reshape(2, len(both), 3)
    return Bins(table[:, :, 0], table[:, :, 1], table[:, :, 2])


def _passes(segment: Segment, value: str) -> list[tuple[float, Float64, Float64]]:
    """Return speed in rad/s, angles and values of each stretch in which the set-point moved at one slow speed."""
    position = segment.column("command_position")
    at: Int64 = np.flatnonzero(np.diff(position) != 0.0) + 1
    if len(at) < 3:
        return []
    fresh = np.zeros(len(position), bool)
    fresh[reports(segment).first] = True
    # Commands come at one rate: their instants are known to a sample's period only, their usual interval is not.
    speed = np.diff(position[at]) / float(np.median(np.diff(segment.time[at])))
    fresh &= np.isfinite(segment.column("angle")) & np.isfinite(segment.column(value))
    found = []
    begin = 0
    for k in range(1, len(speed) + 1):
        if k < len(speed) and abs(speed[k] - speed[begin]) <= _SAME * abs(speed[begin]):
            continue
        start, end = float(segment.time[at[begin]]) + _SETTLE_S, float(segment.time[at[k]])
        if end > start and 0.0 < abs(speed[begin]) <= SLOW:
            taken = fresh & (segment.time > start) & (segment.time < end)
            found.append((float(speed[begin]), segment.column("angle")[taken], segment.column(value)[taken]))
        begin = k
    return found


def _binned(parts: list[tuple[Float64, Float64]], width: float) -> dict[int, tuple[float, float, float]]:
    """Return mean angle, mean value and its standard error by the number of the bin."""
    if not parts:
        return {}
    angle = np.concatenate([a for a, _ in parts])
    value = np.concatenate([v for _, v in parts])
    keys = np.floor(angle / width).astype(np.int64)
    order = np.argsort(keys, kind="stable")
    found = {}
    for part in np.split(order, np.flatnonzero(np.diff(keys[order])) + 1):
        if len(part) >= 3:
            error = float(np.std(value[part], ddof=1)) / float(np.sqrt(len(part)))
            found[int(keys[part[0]])] = (float(np.mean(angle[part])), float(np.mean(value[part])), error)
    return found
