"""Watch of the plate's speed by the motor's encoder.

Every sample of it is looked at, not one a beat.
"""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.copying import copy_into
from etb_hil.base.rewinding import Rewindable
from etb_hil.recording.samples import Float64, Int64, SampleBlock

SPAN_NS = 5_000_000  # velocity is the travel over this time: long enough for an encoder's steps


class SpeedWatch(Rewindable):
    """Means of the motor's velocity over `SPAN_NS`.

    They go back to the newest sample that is that much older; any chunking gives the same values.
    """

    LIVES = ("_time_ns", "_angle", "_newest")

    def __init__(self) -> None:
        self._time_ns = np.empty(0, np.int64)
        self._angle = np.empty(0)
        self._newest = 0.0

    def push(self, block: SampleBlock) -> tuple[float, float]:
        """Take samples with a `motor_angle`; return newest and largest velocity.

        The newest is the one known, the largest that of these samples.

        Both in rad/s at the motor's shaft, with sign; the largest is 0 where none has an older one to be compared with.
        """
        self._time_ns, self._angle, self._newest, peak = _speeds(
            self._time_ns, self._angle, block.time_ns, block.columns["motor_angle"], self._newest
        )
        return self._newest, peak


@njit(cache=True, error_model="numpy")
def _speeds(
    seen_ns: Int64, seen: Float64, new_ns: Int64, new: Float64, newest: float
) -> tuple[Int64, Float64, float, float]:
    """Return the newest velocity, the largest one, and samples for those to come.

    Samples to come are compared with them.
    """
    time_ns = np.empty(len(seen) + len(new), np.int64)
    angle = np.empty(len(time_ns))
    count = len(seen)
    copy_into(time_ns, 0, seen_ns)
    copy_into(angle, 0, seen)
    for k in range(len(new)):
        if not np.isnan(new[k]):
            time_ns[count], angle[count] = new_ns[k], new[k]
            count += 1
    oldest, peak = 0, 0.0
    for k in range(1, count):
        if time_ns[k] < time_ns[k - 1]:  # the clock was set back: what was before says nothing of now
            oldest = k
        while oldest < k and time_ns[k] - time_ns[oldest + 1] >= SPAN_NS:
            oldest += 1
        if k >= len(seen) and time_ns[k] - time_ns[oldest] >= SPAN_NS:
            newest = (angle[k] - angle[oldest]) / ((time_ns[k] - time_ns[oldest]) * 1e-9)
            if abs(newest) > abs(peak):
                peak = newest
    return time_ns[oldest:count].copy(), angle[oldest:count].copy(), newest, peak
