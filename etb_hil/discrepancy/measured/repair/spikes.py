"""Detection of spikes: single values that no throttle can produce."""

from __future__ import annotations

import numpy as np

from etb_hil.discrepancy.measured.measurement import Measurement, current_rms, plate_rms
from etb_hil.discrepancy.measured.repair.regression import robust_least_squares
from etb_hil.recording.samples import Float64, Int64

# Decision 0029. Benches with and without such faults: benchmarks/explain_study.py, --view rough_bench.
_FAR = 30.0  # times the sensor's noise
_AGREES = 0.2  # of an angle's jump, within which the samples before and after it agree
_KEPT = 0.3  # of what a winding keeps of a current until the next sample
_TRUSTED = 90.0  # times the sensor's noise: where more counts for near, samples miss commands, or are another's


def without_spikes(measured: Measurement) -> dict[str, tuple[Float64, int]]:
    """Return by name the signals (n) without their spikes, and how many there were.

    Spikes of an angle are isolated. Commands may change a current within a sample, too: its spikes are what its winding
    cannot do. The voltage may be commanded so, and is not tested.
    """
    m = measured
    found: dict[str, tuple[Float64, int]] = {}
    for name, values, rms in (("angle", m.angle, m.angle_noise), ("plate", m.plate, plate_rms(m.sensors))):
        at = np.zeros(0, np.int64) if values is None else _alone(values, _FAR * rms)
        if values is not None and len(at):
            found[name] = _filled(values, at, 0.5 * (values[at - 1] + values[at + 1])), len(at)
    if m.current is not None:
        at, instead = _of_no_winding(m, m.current)
        if len(at):
            found["current"] = _filled(m.current, at, instead), len(at)
    return found


def _alone(values: Float64, least: float) -> Int64:
    """Return the samples (k) farther than `least` from both extrapolated neighbours."""
    second, before, own, after, last = (values[k : len(values) - 4 + k] for k in range(5))
    ahead, back = 2.0 * before - second, 2.0 * after - last
    away = np.minimum(np.abs(own - ahead), np.abs(own - back))
    moves = np.maximum(np.abs(before - second), np.abs(last - after))  # a plate bounces off its stop by as much
    is_alone = np.abs(ahead - back) < _AGREES * away
    return np.flatnonzero(is_alone & (away > least + moves)) + 2


def _of_no_winding(m: Measurement, current: Float64) -> tuple[Int64, Float64]:
    """Return the samples (k) with an impossible winding current, and its estimate.

    At the end of a sample a winding's current is linear in the current at its beginning, in the travel and in the
    voltage, of that sample or, where the current is read late, of the one before.
    """
    drives = np.column_stack([_both(m.voltage[:-1]), _both(np.diff(m.angle)), np.ones(len(current) - 1)])
    regressors = np.column_stack([current[:-1], drives])
    numbers, far = robust_least_squares(regressors, current[1:], _FAR * current_rms(m.sensors))
    if far > _TRUSTED * current_rms(m.sensors):
        return np.zeros(0, np.int64), np.zeros(0)
    should = regressors[:-1] @ numbers
    after = numbers[0] * should + drives[1:] @ numbers[1:]  # of a current that was as it should be
    away = np.abs(current[1:-1] - should)
    # Had the current been there, the next sample would have what a winding keeps of it.
    was_not_there = np.abs(current[2:] - after) < _KEPT * abs(numbers[0]) * away
    at = np.flatnonzero((away > far) & was_not_there)
    return at + 1, should[at]


def _both(values: Float64) -> Float64:
    """Return values (n, 2): each with the one before it."""
    return np.column_stack([values, np.concatenate([values[:1], values[:-1]])])


def _filled(values: Float64, at: Int64, instead: Float64) -> Float64:
    found = values.copy()
    found[at] = instead
    return found
