"""When a command reached the controller, on the clock of the samples.

The result also says how well that is known.

A command has the stamp of its own frame, and a sample those of its frames. A sample was taken when its first frame
started, where the bus was free. The difference of both clocks is therefore the stamp of a sample's last frame, less
what its frames took on the bus, less the sample's time. Where commands have no stamps, a command came between the
frames of two samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.motion.repeats import Reading
from etb_hil.diagnosis.segments import BUS_TIME, COMMAND_AGE, COMMAND_FRAME_AGE, Segment
from etb_hil.recording.samples import Int64

ARRIVED = 0.5  # share of the commanded way: a plate that goes less far has not followed
_NEAR_S = 0.03  # of samples after a command: clocks that drift apart by 1e-4 do so by 3 us
_FEWEST = 3  # samples whose scatter is known
_MOST_ON_BUS = 0.54e-3  # s, where the bus is not known: two classic frames of 8 bytes at 500 kbit/s
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


def reports(segment: Segment) -> Reports:
    """Return how the samples of a segment arrive.

    Without any of the roles that a burst has once, each sample came by itself.
    """
    columns = [column for role in _SLOW_ROLES if np.isfinite(column := segment.column(role)).any()]
    fresh = np.full(len(segment.time), not columns)
    fresh[:1] = True
    for column in columns:
        fresh[1:] |= (column[1:] != column[:-1]) & np.isfinite(column[1:])
    first = np.flatnonzero(fresh)
    step = float(np.median(np.diff(segment.time))) if len(segment.time) > 1 else 0.0
    period = float(np.median(np.diff(segment.time[first]))) if len(first) > 1 else step
    return Reports(first, period, max(period - step, 0.0))


def instant(segment: Segment, index: int) -> Reading:
    """Return when the command came that sample `index` is the first to hold.

    The time is in s on the clock of the samples. Each of the next samples says it. Those behind a frame of a command
    are left out, which may have waited for it. Their scatter is that of the stamps, one of which is the command's own.
    """
    how = reports(segment)
    since = segment.time[how.first] - segment.time[index]
    first = np.append(index, how.first[(since > 0.0) & (since < _NEAR_S)])
    age, seen, on_bus = (segment.column(name)[first] for name in (COMMAND_AGE, COMMAND_FRAME_AGE, BUS_TIME))
    sent = segment.time[first] + how.span
    came = (sent - age + on_bus)[seen > on_bus]
    if len(came) >= _FEWEST:
        stamp = TWO_SIDED_95 * float(np.std(came))
        return Reading(float(np.median(came)), own=((stamp, stamp),))
    bounds = (0.5 * _MOST_ON_BUS, 0.5 * how.period)
    time = float(sent[0]) + bounds[0]
    if np.isfinite(age[0]):
        return Reading(time - float(age[0]), (bounds[:1] * 2,))
    return Reading(time - bounds[1], tuple((bound, bound) for bound in bounds))


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
