"""How well the computer's stamps follow the controller's sample clock.

The quality is told by offset, drift, and the residual.
"""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import Int64
from etb_hil.results.run_result import Clock


def grade_clock(recording: Recording) -> Clock:
    """Fit stamp = offset + (1 + drift) time; return drift and residual.

    The busiest source is fitted.
    """
    if recording.clock is not ClockGrade.SAMPLE_COUNTER or not recording.sources:
        return Clock()
    block = max((recording.block(source) for source in recording.sources), key=len)
    if len(block) < 3:
        return Clock()
    slope, rms, worst = _line(block.time_ns, block.stamp_ns)
    return Clock(slope * 1e6, rms * 1e-3, worst * 1e-3)


@njit(cache=True, error_model="numpy")
def _line(time_ns: Int64, stamp_ns: Int64) -> tuple[float, float, float]:
    """Return slope, rms and worst residual (ns) of stamp - time over time.

    Sums run in the order of time.
    """
    n = len(time_ns)
    t_mean, y_mean = 0.0, 0.0
    for i in range(n):
        t_mean += float(time_ns[i] - time_ns[0])
        y_mean += float((stamp_ns[i] - stamp_ns[0]) - (time_ns[i] - time_ns[0]))
    t_mean, y_mean = t_mean / n, y_mean / n
    tt, ty = 0.0, 0.0
    for i in range(n):
        t = float(time_ns[i] - time_ns[0]) - t_mean
        tt += t * t
        ty += t * (float((stamp_ns[i] - stamp_ns[0]) - (time_ns[i] - time_ns[0])) - y_mean)
    slope = ty / tt if tt > 0.0 else 0.0
    square, worst = 0.0, 0.0
    for i in range(n):
        t = float(time_ns[i] - time_ns[0]) - t_mean
        left = float((stamp_ns[i] - stamp_ns[0]) - (time_ns[i] - time_ns[0])) - y_mean - slope * t
        square += left * left
        worst = max(worst, abs(left))
    return slope, np.sqrt(square / n), worst
