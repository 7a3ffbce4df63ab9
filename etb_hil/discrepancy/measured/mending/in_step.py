"""Whether the voltage of a record stands in the rows that it drove: a logger may write what it set a row too late."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.measured.measurement import Float64, Measurement
from etb_hil.discrepancy.measured.mending.regression import by_most_rows
from etb_hil.discrepancy.measured.rows import commanded, open_bridge
from etb_hil.discrepancy.measured.sheet import current_rms, voltage_rms

# Decision 0029. Benches with and without such faults: benchmarks/explain_study.py, --view rough_bench.
_REACH = 3  # samples to either side
_SHIFTS = np.arange(-_REACH, _REACH + 1)
_WAYS = np.arange(-1, 2)  # samples from whose way the back-EMF may be
_FEWEST = 100  # samples with a jump about them, by the numbers that are fitted
_FAR = 30.0  # times the current sensor's noise
_ALONE = 0.8  # of what all voltages do: it is one sample's
_OTHERS = 0.25  # of it, that all others do at most, added up without their signs
_WITH_IT = 0.5  # samples that the motion may be off the current


def rows_late(measured: Measurement) -> int:
    """Return by how many samples the voltage stands later than the current that answers it; 0 where none is sure.

    At the end of a sample a winding's current is linear in the current at its beginning, in the way and in the
    voltage of that sample alone. A current that is itself read late, or through a filter, answers the voltages of
    several samples, or the motion is as late beside it.
    """
    m = measured
    if m.current is None:
        return 0
    rows = _telling_rows(m, m.current)
    if len(rows) < _FEWEST * len(_SHIFTS):
        return 0
    columns = [m.voltage[rows + k] for k in _SHIFTS]
    columns += [m.angle[rows + 1 + k] - m.angle[rows + k] for k in _WAYS]
    current = m.current[rows]
    # Brushes and a bridge's dead time take a voltage by the current's sign.
    asked = np.column_stack([*columns, current, np.sign(current), np.ones(len(rows))])
    far = _FAR * current_rms(m.sensors)
    # What a current that is hardly kept until the next sample does, its noise hides: then the plain numbers are better.
    fits = (by_most_rows(asked, m.current[rows + 1], far, noise).numbers for noise in (_noise(m), None))
    return next((shift for fit in fits if (shift := _shift(fit)) is not None), 0)


def _shift(numbers: Float64) -> int | None:
    """Return the row whose voltage alone a current answers, by what a fit gives; None where it is not one row's."""
    shares, ways = numbers[: len(_SHIFTS)], numbers[len(_SHIFTS) :][: len(_WAYS)]
    shares = shares / shares.sum()
    best = int(np.argmax(shares))
    others = float(np.abs(np.delete(shares, best)).sum())
    is_one = shares[best] > _ALONE and others < _OTHERS * shares[best]
    is_with_the_motion = abs(float(_WAYS @ ways)) < _WITH_IT * abs(float(ways.sum()))
    return int(_SHIFTS[best]) if is_one and is_with_the_motion else None


def _telling_rows(m: Measurement, current: Float64) -> NDArray[np.int64]:
    """Return the rows (k) of a driven motor that have a step of the voltage about them, and no spike of the current."""
    jumps = np.concatenate([[False], commanded(m)])
    beside = np.array([current[:-2], current[1:-1], current[2:]])
    is_spike = np.abs(current[1:-1] - np.median(beside, axis=0)) > _FAR * current_rms(m.sensors)
    is_driven = m.is_good & ~open_bridge(m) & ~np.pad(is_spike, 1)
    near = np.convolve(jumps, np.ones(len(_SHIFTS)), "same") > 0.5
    rows = np.flatnonzero(near & is_driven)
    rows = rows[(rows >= _REACH) & (rows < len(m) - _REACH - 1)]
    return rows[is_driven[rows + 1]]


def _noise(m: Measurement) -> Float64:
    """Return the covariance of the columns' noise: two neighbouring ways share the angle between them."""
    voltages, ways = len(_SHIFTS), len(_WAYS)
    found = np.zeros((voltages + ways + 3, voltages + ways + 3))
    found[:voltages, :voltages] = np.eye(voltages) * voltage_rms(m.sensors) ** 2
    of_angle = 2.0 * np.eye(ways) - np.eye(ways, k=1) - np.eye(ways, k=-1)
    found[voltages:-3, voltages:-3] = of_angle * m.angle_noise**2
    found[-3, -3] = current_rms(m.sensors) ** 2
    return found
