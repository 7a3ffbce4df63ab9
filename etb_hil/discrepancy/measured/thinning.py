"""Rows that come faster than they tell anything: every so many of them, with the mean of what drives until the next."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from etb_hil.discrepancy.measured.measurement import Float64, Measurement

_ENOUGH = 2000.0  # Hz: what more rows would show is noise


def thinned(measured: Measurement) -> Measurement:
    """Return every so many rows; a voltage, or a drive's force, is its mean until the next row that is kept.

    A row is good where all are that its voltage is the mean of.
    """
    every = int(measured.rate / _ENOUGH + 1e-6)
    if every <= 1:
        return measured
    whole = len(measured) // every * every

    def kept(values: Float64 | None) -> Float64 | None:
        return None if values is None else values[:whole:every]

    voltage = measured.voltage[:whole].reshape(-1, every).mean(axis=1)
    return replace(
        measured,
        rate=measured.rate / every,
        voltage=voltage,
        angle=measured.angle[:whole:every],
        current=voltage if measured.is_drive else kept(measured.current),
        plate=kept(measured.plate),
        temperature=measured.temperature[:whole:every],
        supply=kept(measured.supply),
        is_good=np.all(measured.is_good[:whole].reshape(-1, every), axis=1),
        encoder=kept(measured.encoder),
        added=kept(measured.added),
    )
