"""When a command reached the controller, on the clock of the samples, and how well that is known.

A command has the stamp of its own frame; samples hold the last command that was stamped before them. The command came
between the frames of two samples. The clock of the samples begins with the stamp of the first frame, so that it runs
late by what that frame took: the time over which its samples were gathered, and its time on the bus.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from etb_hil.diagnosis.segments import Segment
from etb_hil.recording.samples import Int64

# s: none where nothing was on a bus, two classic frames of 8 bytes at 500 kbit/s at most.
UNKNOWN_REPORT_TIME = 0.0, 0.54e-3
_SLOW_ROLES = ("motor_voltage", "throttle_angle", "throttle_angle_2")


@dataclass(frozen=True, slots=True)
class Reports:
    """How samples arrive: `first` (m) are the samples that brought values of their own in every role.

    In a burst only the first sample has its own voltage and plate angle. `period` s lies between two frames; `span` s
    between the first and the last sample of one.
    """

    first: Int64
    period: float
    span: float


@dataclass(frozen=True, slots=True)
class Instant:
    """When a command came: the first sample after it, its time in s, and how far that may be off either way."""

    index: int
    time: float
    bounds: tuple[float, float]


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


def instant(segment: Segment, index: int, report_time: tuple[float, float]) -> Instant:
    """Return when the command came that sample `index` is the first to hold; `report_time` s as in `Findings`."""
    how = reports(segment)
    least, most = report_time
    time = float(segment.time[index]) - 0.5 * how.period + how.span + 0.5 * (least + most)
    return Instant(index, time, (0.5 * how.period, 0.5 * (most - least)))


def holds(segment: Segment) -> list[tuple[int, int, float]]:
    """Return the segments in which one position is commanded: first sample, end, position in rad."""
    mode, position = segment.column("command_mode"), segment.column("command_position")
    changed = np.flatnonzero((np.diff(position) != 0.0) | (np.diff(mode) != 0.0)) + 1
    edges = [0, *changed.tolist(), len(position)]
    return [
        (begin, end, float(position[begin])) for begin, end in pairwise(edges) if end > begin and mode[begin] == 1.0
    ]
