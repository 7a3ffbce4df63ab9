"""Repair of uneven time stamps of evenly read samples: a host's clock."""

from __future__ import annotations

import numpy as np

from etb_hil.recording.samples import Float64, Int64

# Decision 0029. Benches with and without such faults: benchmarks/explain_study.py, --view rough_bench.
_EVEN = 0.05  # of a sample, by which the stamps of even samples may be off
_FEWEST = 200  # samples
_AROUND = 25  # samples that a host does not delay by half a sample more than all others: one was lost
_HALF = 0.5  # of what the stamps say of the motion: with less they are not its times
_SURE = 4.0  # standard errors


def even_times(time_ns: Int64, angle: Float64) -> tuple[Int64, list[str]]:
    """Return the times (n, ns) of the samples, and why they differ from the stamps.

    `angle` (n) in any unit, NaN where it is missing. A sample that was read late has moved on by then. If the angle's
    curvature is uncorrelated with that of the stamps, the samples were even, and the scatter is the host's.
    """
    if len(time_ns) < _FEWEST:
        return time_ns, []
    samples, seconds = np.arange(len(time_ns)), (time_ns - time_ns[0]) * 1e-9
    step, begin = np.polyfit(samples, seconds, 1)
    off = seconds - (begin + step * samples)
    scatter = float(np.sqrt(np.mean(off**2)))
    if scatter < _EVEN * step or _lacks_samples(off, step):
        return time_ns, []
    share, error = _followed(off, angle, step)
    if share + _SURE * error > _HALF:
        return time_ns, []
    what = f"time stamps scatter by {1e3 * scatter:.2g} ms (rms) about an even clock, and the motion does not"
    return time_ns[0] + np.round(samples * step * 1e9).astype(np.int64), [
        f"{what}: the analysis takes the samples as evenly spaced"
    ]


def _lacks_samples(off: Float64, step: float) -> bool:
    """Tell whether stamps deviate for longer than a host is late: a sample is missing."""
    middle = np.median(np.lib.stride_tricks.sliding_window_view(off, _AROUND), axis=1)
    return bool(np.ptp(middle) > 0.5 * step)


def _followed(off: Float64, angle: Float64, step: float) -> tuple[float, float]:
    """Return the share of the stamps' scatter that the motion shows, with its error."""
    bend = angle[1:-1] - 0.5 * (angle[:-2] + angle[2:])
    late = off[1:-1] - 0.5 * (off[:-2] + off[2:])
    asked = (angle[2:] - angle[:-2]) / (2.0 * step) * late
    known = np.isfinite(bend)
    bend, asked = bend[known], asked[known]
    size = float(asked @ asked)
    if size == 0.0:
        return 1.0, 0.0
    share = float(asked @ bend) / size
    return share, float(np.sqrt(np.mean((bend - share * asked) ** 2) / size))
