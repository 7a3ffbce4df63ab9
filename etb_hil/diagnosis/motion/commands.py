"""When a command reached the controller, on the clock of the samples.

The result also says how well that is known.

A command has the stamp of its own frame, and a sample that of its own. The clock of the samples is that of their
frames, less what a frame takes: the time over which its samples were gathered, and its time on the bus. Where commands
have no stamps, a command came between the frames of two samples. A frame of a command that ended when those of a sample
began may have kept them waiting.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from etb_hil.diagnosis.segments import COMMAND_AGE, COMMAND_FRAME_AGE, Segment
from etb_hil.recording.report_time import ReportTime
from etb_hil.recording.samples import Int64

_SLOW_ROLES = ("motor_voltage", "throttle_angle", "throttle_angle_2")


@dataclass(frozen=True, slots=True)
class Reports:
    """How samples arrive.

    `first` (m) are the samples that brought values of their own in every role. In a burst only the first sample has its
    own voltage and plate angle. `period` s lies between two frames; `span` s between the first and the last sample of
    one.
    """

    first: Int64
    period: float
    span: float


@dataclass(frozen=True, slots=True)
class Instant:
    """When a command came: the first sample after it, and its time in s.

    `bounds` s are how far the time may be off either way.
    """

    index: int
    time: float
    bounds: tuple[float, ...]


def reports(segment: Segment) -> Reports:
    """Return how the samples of a segment arrive."""
    fresh = np.zeros(len(segment.time), bool)
    fresh[:1] = True
    for role in _SLOW_ROLES:
        column = segment.column(role)
        fresh[1:] |= (column[1:] != column[:-1]) & np.isfinite(column[1:])
    first = np.flatnonzero(fresh)
    step = float(np.median(np.diff(segment.time))) if len(segment.time) > 1 else 0.0
    period = float(np.median(np.diff(segment.time[first]))) if len(first) > 1 else step
    return Reports(first, period, max(period - step, 0.0))


def instant(segment: Segment, index: int, report_time: ReportTime) -> Instant:
    """Return when the command came that sample `index` is the first to hold."""
    how = reports(segment)
    age, seen = (float(segment.column(name)[index]) for name in (COMMAND_AGE, COMMAND_FRAME_AGE))
    has_stamps = math.isfinite(age)
    before, between = (age, ()) if has_stamps else (0.5 * how.period, (0.5 * how.period,))
    is_free = has_stamps and seen > report_time.most
    least, most = report_time.least, report_time.most + (0.0 if is_free else report_time.wait)
    time = float(segment.time[index]) - before + how.span + 0.5 * (least + most)
    return Instant(index, time, (*between, 0.5 * (most - least)))


def holds(segment: Segment) -> list[tuple[int, int, float]]:
    """Return the segments in which one position is commanded.

    Each has its first sample, its end, and the position in rad.
    """
    mode, position = segment.column("command_mode"), segment.column("command_position")
    changed = np.flatnonzero((np.diff(position) != 0.0) | (np.diff(mode) != 0.0)) + 1
    edges = [0, *changed.tolist(), len(position)]
    return [
        (begin, end, float(position[begin])) for begin, end in pairwise(edges) if end > begin and mode[begin] == 1.0
    ]
