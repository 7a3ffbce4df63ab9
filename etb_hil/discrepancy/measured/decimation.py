"""Decimation of a record that is sampled faster than needed, with mean voltages."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.sampling import commanded, in_blocks
from etb_hil.recording.samples import Float64

_ENOUGH = 2000.0  # Hz: what more samples would show is noise
_PLENTY = 5000.0  # Hz: a voltage that changes within such a sample is near enough to its mean
_FEWEST = 100  # jumps: at fast rates, means over fewer of them do not matter
_IN_STEP = 0.98  # of them


def decimated(measured: Measurement) -> Measurement:
    """Return a measurement at the rate of balances."""
    return measured if measured.is_decimated else replace(at_least(_ENOUGH, measured), is_decimated=True)


def at_least(rate: float, measured: Measurement) -> Measurement:
    """Return every n-th sample, with mean voltage or force until the next kept one.

    Keep at least `rate` samples a second (Hz). They are in step with the commands, so that a voltage is held from one
    to the next as it was: no mean shows what a current does after a step within a sample. Where no such rate is in
    step, the mean over a fifth of a millisecond is near enough. A sample is good if all samples of its mean are.
    """
    first, every = _step(measured, rate)
    if every <= 1:
        return measured
    whole = first + (len(measured) - first) // every * every

    def kept(values: Float64 | None) -> Float64 | None:
        return None if values is None else values[first:whole:every]

    voltage = in_blocks(measured.voltage[first:], every).mean(axis=1)
    return replace(
        measured,
        rate=measured.rate / every,
        start_s=measured.start_s + first * measured.dt,
        voltage=voltage,
        angle=measured.angle[first:whole:every],
        current=kept(measured.current) if measured.device.has_winding else voltage,
        plate=kept(measured.plate),
        temperature=measured.temperature[first:whole:every],
        is_good=np.all(in_blocks(measured.is_good[first:], every), axis=1),
        encoder=kept(measured.encoder),
        added=kept(measured.added),
    )


def _step(measured: Measurement, rate: float) -> tuple[int, int]:
    """Return the first kept sample, and the decimation factor."""
    most = int(measured.rate / rate + 1e-6)
    if most <= 1 or not measured.device.has_winding:
        return 0, most
    samples = np.flatnonzero(commanded(measured)) + 1
    if not len(samples) or (len(samples) < _FEWEST and measured.rate > _ENOUGH):
        return 0, most
    for every in range(most, 1, -1):
        jumps = np.bincount(samples % every, minlength=every)
        if jumps.max() > _IN_STEP * len(samples):
            return int(jumps.argmax()), every
    return 0, int(measured.rate / _PLENTY + 1e-6)
