"""Detection of commands between two samples that the record does not show.

A sample's voltage is held until the next one. If a controller commands more often than samples are written, nobody
knows what the motor got between two of them, and no model reaches the noise floor.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from etb_hil.discrepancy.measured.angles import between_steps
from etb_hil.discrepancy.measured.bridge_opening import without_diodes
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.sampling import commanded, open_bridge
from etb_hil.plant.parameters import Model
from etb_hil.recording.samples import Float64, Int64

# Decision 0029. Records that miss commands, and those that do not: benchmarks/explain_study.py, --rate 500 and 2000.
FAST = 900.0  # Hz; controllers of throttles command some 1000 times a second
_SHORTEST = 0.0005  # s; in a shorter time a current does less than its sensor's noise
_FEWEST = 100  # jumps
_KNEES = (0.05, 0.15, 0.3)  # A, at which a brush's drop may be there
_BEFORE = 0.04  # of what a voltage does in its own sample, from where the next one has acted before its sample
_SCATTERS = 0.015  # of the next jump's square: what no shift of the voltage in time accounts for


def may_miss_commands(measured: Measurement, model: Model) -> bool:
    """Tell whether commands may have changed between the samples of a raw measurement.

    While a voltage is held, a winding's current is linear in the current before it, in the travel and in the voltage;
    the next voltage has no part in it. A current read late has the same part each time, which leaves no scatter. Slow
    samples without a current show nothing.
    """
    if not measured.device.has_winding:
        return False
    if measured.current is None:
        return measured.rate < FAST
    m, current = without_diodes(measured, model), measured.current
    begins, ends = _before_jumps(m)
    if len(ends) < _FEWEST:
        return False
    voltage, jump = _means(m.voltage, begins, ends), m.voltage[ends] - m.voltage[ends - 1]
    angle = between_steps(m.angle)  # within one sample a step of a coarse encoder tells little of travel
    began, ended, way = current[begins], current[ends], angle[ends] - angle[begins]
    # What takes a voltage by the current between a command and the winding: brushes and dead time, a supply that sags;
    # and a current's sensor whose scale bends.
    taken = [*(np.tanh(began / knee) for knee in _KNEES), voltage * np.abs(began), voltage**2 * began, began**2]
    regressors = np.column_stack([voltage, jump, began, way, *taken, np.ones(len(jump))])
    found, *_ = np.linalg.lstsq(regressors, ended, rcond=None)
    own, early = found[:2].tolist()
    scattered = float(np.mean((ended - regressors @ found) ** 2))
    return early > _BEFORE * own and scattered > _SCATTERS * own**2 * float(np.mean(jump**2))


def rate_of_voltage(measured: Measurement) -> float:
    """Return the rate (Hz) at which the voltage is known; a burst's samples share one."""
    return measured.rate / _samples_together(measured, np.flatnonzero(commanded(measured)))


def _samples_together(measured: Measurement, jumps: Int64) -> int:
    """Return how many samples before a jump are averaged: the length of one voltage."""
    most = int(measured.rate * _SHORTEST + 1e-6)
    if most <= 1 or not len(jumps):
        return 1
    return int(np.clip(np.median(np.diff(jumps, prepend=-1)), 1, most))


def _before_jumps(m: Measurement) -> tuple[Int64, Int64]:
    """Return the samples where a voltage begins, and those of its jump, bridge on."""
    jumps = np.flatnonzero(commanded(m))
    samples = _samples_together(m, jumps)
    ends = jumps[np.diff(jumps, prepend=-1) >= samples] + 1
    begins = ends - samples
    is_driven = _means((m.is_good & ~open_bridge(m)).astype(np.float64), begins, ends + 1) == 1.0
    return begins[is_driven], ends[is_driven]


def _means(values: Float64, begins: Int64, ends: Int64) -> Float64:
    """Return means over windows of equal length, from a sample to before its end."""
    if not len(ends):
        return np.zeros(0)
    return np.asarray(sliding_window_view(values, int(ends[0] - begins[0]))[begins].mean(axis=1))
