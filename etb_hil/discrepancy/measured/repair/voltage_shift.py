"""Detection of a voltage that is logged some samples late or early."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.measured.measurement import Measurement, current_rms, voltage_rms
from etb_hil.discrepancy.measured.repair.regression import robust_least_squares
from etb_hil.discrepancy.measured.sampling import commanded, open_bridge
from etb_hil.recording.samples import Float64

# Decision 0029. Benches with and without such faults: benchmarks/explain_study.py, --view rough_bench.
_REACH = 3  # samples to either side
_SHIFTS = np.arange(-_REACH, _REACH + 1)
_WAYS = np.arange(-1, 2)  # samples from whose way the back-EMF may be
_FEWEST = 100  # samples with a jump about them, by the numbers that are fitted
_FAR = 30.0  # times the current sensor's noise
_ALONE = 0.8  # of what all voltages do: it is one sample's
_OTHERS = 0.25  # of it, that all others do at most, added up without their signs
_WITH_IT = 0.5  # samples that the motion may be off the current


def voltage_shift(measured: Measurement) -> int:
    """Return by how many samples the voltage is later than its current; 0 if unsure.

    At the end of a sample a winding's current is linear in the current at its beginning, in the travel and in the
    voltage of that sample alone. A current that is itself read late, or filtered, answers the voltages of several
    samples, or the motion is as late.
    """
    m = measured
    if m.current is None:
        return 0
    at = _informative_samples(m, m.current)
    if len(at) < _FEWEST * len(_SHIFTS):
        return 0
    regressors = [m.voltage[at + k] for k in _SHIFTS]
    regressors += [m.angle[at + 1 + k] - m.angle[at + k] for k in _WAYS]
    current = m.current[at]
    # Brushes and a bridge's dead time take a voltage by the current's sign.
    asked = np.column_stack([*regressors, current, np.sign(current), np.ones(len(at))])
    far = _FAR * current_rms(m.sensors)
    # What a current that is hardly kept until the next sample does, its noise hides: then the plain numbers are better.
    fits = (robust_least_squares(asked, m.current[at + 1], far, noise)[0] for noise in (_noise(m), None))
    return next((shift for fit in fits if (shift := _shift(fit)) is not None), 0)


def _shift(numbers: Float64) -> int | None:
    """Return the sample whose voltage alone a current answers; None if it is not one."""
    shares, ways = numbers[: len(_SHIFTS)], numbers[len(_SHIFTS) :][: len(_WAYS)]
    shares = shares / shares.sum()
    best = int(np.argmax(shares))
    others = float(np.abs(np.delete(shares, best)).sum())
    is_one = shares[best] > _ALONE and others < _OTHERS * shares[best]
    is_with_the_motion = abs(float(_WAYS @ ways)) < _WITH_IT * abs(float(ways.sum()))
    return int(_SHIFTS[best]) if is_one and is_with_the_motion else None


def _informative_samples(m: Measurement, current: Float64) -> NDArray[np.int64]:
    """Return the samples (k) near a voltage step, bridge on, without current spikes."""
    jumps = np.concatenate([[False], commanded(m)])
    neighbours = np.array([current[:-2], current[1:-1], current[2:]])
    is_spike = np.abs(current[1:-1] - np.median(neighbours, axis=0)) > _FAR * current_rms(m.sensors)
    is_driven = m.is_good & ~open_bridge(m) & ~np.pad(is_spike, 1)
    near = np.convolve(jumps, np.ones(len(_SHIFTS)), "same") > 0.5
    at = np.flatnonzero(near & is_driven)
    at = at[(at >= _REACH) & (at < len(m) - _REACH - 1)]
    return at[is_driven[at + 1]]


def _noise(m: Measurement) -> Float64:
    """Return the covariance of the regressors' noise; differences share an angle."""
    voltages, ways = len(_SHIFTS), len(_WAYS)
    found = np.zeros((voltages + ways + 3, voltages + ways + 3))
    found[:voltages, :voltages] = np.eye(voltages) * voltage_rms(m.sensors) ** 2
    of_angle = 2.0 * np.eye(ways) - np.eye(ways, k=1) - np.eye(ways, k=-1)
    found[voltages:-3, voltages:-3] = of_angle * m.angle_noise**2
    found[-3, -3] = current_rms(m.sensors) ** 2
    return found
