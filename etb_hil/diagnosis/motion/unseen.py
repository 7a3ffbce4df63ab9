"""What samples leave open of a motion that they do not show to its end.

Samples were lost during it, or the plate still moved when the next command came.
"""

from __future__ import annotations

import math

import numpy as np

from etb_hil.diagnosis.segments import COMMAND_FRAME_AGE, Segment
from etb_hil.recording.samples import Float64

# s. The springs of the default model alone accelerate the plate by 262 rad/s^2, which takes it 0.05 deg off the line
# across such a gap (a t^2 / 8): a twentieth of the 1 deg that a return is judged by.
GAP_S = 5e-3
FEWEST = 8  # samples of a motion: every second one of them has a spline
# Commands come at a steady pace, so that the last one is at most one pace old, and half of one in the mean. Where it is
# older than one and a half, one was lost.
_PACES = 1.5


def shown(segment: Segment, begin: int, end: int) -> tuple[Float64, Float64]:
    """Return times in s and angles in rad (n each) of samples with an angle.

    Each time is there once.
    """
    time, angle = segment.time[begin:end], segment.column("angle")[begin:end]
    known = np.isfinite(angle)
    time, angle = time[known], angle[known]
    fresh = np.diff(time, prepend=-np.inf) > 0.0
    return time[fresh], angle[fresh]


def gap(time: Float64, first: int, longest: float = GAP_S) -> float:
    """Return the longest time without samples that is longer than `longest`.

    Both are in s. It is 0 where there is none. Times (n) in s count from the sample before `first`.
    """
    found = float(np.max(np.diff(time)[max(first - 1, 0) :], initial=0.0))
    return found if found > longest else 0.0


def gap_note(seconds: float) -> str:
    """Say in words how long there were no samples."""
    return f"no samples for {seconds * 1e3:.0f} ms of the motion: how long it took is not known"


FEW = "too few samples of the motion: how long it took is not known"
COMMANDS_LOST = "commands are missing before this one or the next: when it came is not known"


def commands_lost(segment: Segment, index: int) -> bool:
    """Return whether commands are missing before that of sample `index`.

    The one that was seen may then have come before, unseen. Without stamps of commands nothing says so.
    """
    if index >= len(segment.time):
        return False
    ages = segment.column(COMMAND_FRAME_AGE)
    before = ages[max(index - 1, 0)]
    pace = 2.0 * float(np.median(ages[np.isfinite(ages)])) if np.isfinite(before) else math.nan
    return bool(before > _PACES * pace)


def swing_reach(angle: Float64, last: float, error: float) -> tuple[float, float]:
    """Return how far below and above `last` the final angle of a swing may lie.

    All are in rad. The angles (n) are of more than half a swing: the final angle lies between their lowest and highest.
    `error` is the standard deviation of an angle by its steps. Within one step the plate is at rest, and a plate that
    goes on in one direction does not swing: both are 0 then.
    """
    if _is_at_rest(angle, error) or _way(angle) != 0.0:
        return 0.0, 0.0
    return last - float(np.min(angle)), float(np.max(angle)) - last


def creep(angle: Float64, error: float) -> float:
    """Return how far in rad a plate creeps in one direction over its last angles.

    It is 0 where the angles (n) in rad turn round. `error` is as for `swing_reach`.
    """
    return 0.0 if _is_at_rest(angle, error) else _way(angle)


def _is_at_rest(angle: Float64, error: float) -> bool:
    """Return whether angles differ by one step of the encoder at most.

    The error of a step is step / sqrt(12).
    """
    return bool(np.ptp(angle) <= 1.5 * math.sqrt(12.0) * error)


def _way(angle: Float64) -> float:
    """Return how far angles go in one direction, 0 where they turn round."""
    thirds = [float(np.mean(part)) for part in np.array_split(angle, 3)]
    turns = (thirds[1] - thirds[0]) * (thirds[2] - thirds[1]) <= 0.0
    return 0.0 if turns else 1.5 * abs(thirds[2] - thirds[0])  # the middles of the outer thirds are 2/3 of it apart


def outside_until(time: Float64, angle: Float64, first: int, band: float) -> float | None:
    """Return until when a plate is outside a band about its final angle.

    It is so long outside at least, and the final angle may be any: from the last sample on from which the angles (n)
    differ by more than twice the `band`, one of them lies outside. None where no sample from `first` on says so.
    """
    backwards = angle[first:][::-1]
    spread = (np.maximum.accumulate(backwards) - np.minimum.accumulate(backwards))[::-1]
    wide = np.flatnonzero(spread > 2.0 * band)
    return float(time[first + wide[-1]]) if len(wide) else None
