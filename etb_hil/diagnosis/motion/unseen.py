"""What samples leave open of a motion that they do not show to its end.

Samples were lost during it, or the plate still moved when the next command came.
"""

from __future__ import annotations

import numpy as np

from etb_hil.recording.samples import Float64

# s. The default model's motor at its limit and its spring together accelerate the plate by 2,400 rad/s^2 at most, which
# takes it 0.43 deg off the line across such a gap (a t^2 / 8): less than half of the 1 deg that a return is judged by.
_GAP_S = 5e-3
# The error of a spline is taken from every second sample, so that it is known across two of the usual intervals; the
# half is for samples that do not come evenly.
_GAP_INTERVALS = 2.5


def gap(time: Float64, first: int) -> float:
    """Return the longest time without samples that is too long to be read across.

    It is in s, and 0 where there is none. Times (n) in s count from the sample before `first`.
    """
    between = np.diff(time)
    longest = float(np.max(between[max(first - 1, 0) :], initial=0.0))
    return longest if len(between) and longest > max(_GAP_S, _GAP_INTERVALS * float(np.median(between))) else 0.0


def gap_note(seconds: float) -> str:
    """Say in words how long there were no samples."""
    return f"no samples for {seconds * 1e3:.0f} ms of the motion: how long it took is not known"


def outside_until(time: Float64, angle: Float64, first: int, band: float) -> float | None:
    """Return until when a plate is outside a band about its final angle at least.

    The final angle may be any: from the last sample on from which the angles (n) differ by more than twice the `band`,
    one of them lies outside. None where no sample from `first` on says so.
    """
    backwards = angle[first:][::-1]
    spread = (np.maximum.accumulate(backwards) - np.minimum.accumulate(backwards))[::-1]
    wide = np.flatnonzero(spread > 2.0 * band)
    return float(time[first + wide[-1]]) if len(wide) else None
