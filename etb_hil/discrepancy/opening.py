"""The row in which a bridge opens: its diodes give the supply against the current, for a part of the row alone."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.measurement import Measurement
from etb_hil.discrepancy.rows import open_bridge
from etb_hil.plant.parameters import Model
from etb_hil.plant.values import ThrottleParameters

Float64 = NDArray[np.float64]

_BEFORE = 0.025  # s that an opening lies before rows in which no current is seen to have flown for some time
_HIGH, _LOW = 0.8, 0.5  # of the voltage's limit: the diodes give more than that, a motor that coasts gives less


def without_diodes(measured: Measurement, model: Model) -> Measurement:
    """Return a measurement with the mean voltage in the rows in which the bridge opens, which are not judged.

    The current of a throttle is gone after a tenth of a millisecond. What a voltmeter read at the row's beginning, held
    until the next, would be a blow of the whole supply that the motor never felt.
    """
    current, rate, v = measured.current, measured.rate, model.values
    if current is None or measured.is_drive:
        return measured
    is_open = open_bridge(measured, model)
    opens = _openings(measured.voltage, current, is_open, round(_BEFORE * rate), v.voltage_limit)
    if not opens:
        return measured
    voltage, good = measured.voltage.copy(), measured.is_good.copy()
    for row in opens:
        voltage[row] = _mean(float(voltage[row]), float(voltage[row + 1]), float(current[row]), rate, v)
        good[row] = False
    return replace(measured, voltage=voltage, is_good=good)


def _openings(voltage: Float64, current: Float64, is_open: NDArray[np.bool_], before: int, limit: float) -> list[int]:
    """Return the rows that begin with the diodes' voltage against a current, and no drive between them and rest."""
    found = []
    for first in (np.flatnonzero(is_open[1:] & ~is_open[:-1]) + 1).tolist():
        begin = max(first - before, 0)
        driven = np.flatnonzero(np.abs(voltage[begin:first]) > _LOW * limit)
        if len(driven):
            row = begin + int(driven[-1])
            if abs(voltage[row]) > _HIGH * limit and voltage[row] * current[row] < 0.0:
                found.append(row)
    return found


def _mean(diodes: float, after: float, current: float, rate: float, v: ThrottleParameters) -> float:
    """Return the voltage's mean in V over a row: the diodes' until the current is gone, then the motor's own."""
    lasts = v.inductance / v.resistance * math.log1p(v.resistance * abs(current / diodes))
    share = min(lasts * rate, 1.0)
    return share * diodes + (1.0 - share) * after
