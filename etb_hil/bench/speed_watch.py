"""How fast the plate moves by its motor's encoder: every sample of it is looked at, not one a beat."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etb_hil.recording.samples import Float64, SampleBlock

SPAN_NS = 5_000_000  # velocity is the travel over this time: long enough for an encoder's steps


class SpeedWatch:
    """Means of the motor's velocity, back to the newest sample that is `SPAN_NS` older; any chunking, same values."""

    def __init__(self) -> None:
        self._time_ns = np.empty(0, np.int64)
        self._angle = np.empty(0)
        self._newest = 0.0

    def push(self, block: SampleBlock) -> tuple[float, float]:
        """Take samples with a `motor_angle`; return the newest velocity known, and the largest of these samples.

        Both in rad/s at the motor's shaft, with sign; the largest is 0 where none has an older one to be compared with.
        """
        angle = block.columns["motor_angle"]
        is_good = np.isfinite(angle)
        seen = len(self._time_ns)
        time_ns = np.concatenate((self._time_ns, block.time_ns[is_good]))
        angle = np.concatenate((self._angle, angle[is_good]))
        oldest, self._newest, peak = _speeds(time_ns, angle, seen, self._newest)
        self._time_ns, self._angle = time_ns[oldest:], angle[oldest:]
        return self._newest, peak


@njit(cache=True, error_model="numpy")
def _speeds(time_ns: NDArray[np.int64], angle: Float64, seen: int, newest: float) -> tuple[int, float, float]:
    """Return the first sample that those to come are compared with, the newest velocity, and the largest."""
    oldest, peak = 0, 0.0
    for k in range(len(angle)):
        if k > 0 and time_ns[k] < time_ns[k - 1]:  # the clock was set back: what was before says nothing of now
            oldest = k
        while time_ns[k] - time_ns[oldest + 1 if oldest < k else k] >= SPAN_NS:
            oldest += 1
        if k >= seen and time_ns[k] - time_ns[oldest] >= SPAN_NS:
            newest = (angle[k] - angle[oldest]) / ((time_ns[k] - time_ns[oldest]) * 1e-9)
            if abs(newest) > abs(peak):
                peak = newest
    return oldest, newest, peak
