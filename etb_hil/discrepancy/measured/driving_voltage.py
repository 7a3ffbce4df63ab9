"""The voltage that drives a simulation: measured, without the voltmeter's noise."""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.recording.samples import Float64

_AROUND = 0.05  # s to either side
_SAME = 3.0  # times the noise: what is nearer than that is another reading of the same voltage
_PASSES = 2
_MEAN_OF = 0.03  # s to either side
_GAUSS = 0.6745  # median of the absolute value of a normal variable


def without_noise(voltage: Float64, noise: float, rate: float) -> Float64:
    """Return a voltage (n, V) with averaged noise and sharp edges.

    The filter is a sigma filter (Lee 1983). `noise`: the rms of the data sheet in V; if the samples show less, that
    counts. In a simulation driven by a voltmeter's noise the bristles creep, which those of the real plate do not.
    """
    shown = float(np.median(np.abs(np.diff(voltage)))) / (_GAUSS * np.sqrt(2.0)) if len(voltage) > 1 else 0.0
    reach = _SAME * min(noise, shown)
    half = round(_AROUND * rate)
    for _ in range(_PASSES if reach > 0.0 else 0):
        voltage = _averaged(voltage, reach, half)
    return voltage


def with_its_mean(smooth: Float64, voltage: Float64, rate: float) -> Float64:
    """Return a smoothed voltage (n) with the local mean that was measured.

    A filter that keeps edges takes small steps for noise. Friction and a soft spring integrate the lost mean: a
    millivolt is up to five milliradian.
    """
    lost = np.concatenate([[0.0], np.cumsum(voltage - smooth)])
    at = np.arange(len(voltage))
    reach = np.minimum(np.minimum(at, at[::-1]), round(_MEAN_OF * rate))
    return smooth + (lost[at + reach + 1] - lost[at - reach]) / (2 * reach + 1)


@njit(cache=True, error_model="numpy", nogil=True)
def _averaged(values: Float64, reach: float, half: int) -> Float64:
    """Return the mean (n) of each value's neighbours within `reach`, pairwise."""
    found = np.empty_like(values)
    count = values.size
    for k in range(count):
        own, total, samples = values[k], values[k], 1
        for away in range(1, min(half, k, count - 1 - k) + 1):
            before, after = values[k - away], values[k + away]
            # In pairs: a ramp then keeps its place.
            if abs(before - own) < reach and abs(after - own) < reach:
                total += before + after
                samples += 2
        found[k] = total / samples
    return found
