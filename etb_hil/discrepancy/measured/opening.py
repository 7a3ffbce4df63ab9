"""The row in which a bridge opens: its diodes give the supply against the current, for a part of the row alone."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.rows import commanded, open_bridge
from etb_hil.discrepancy.measured.sheet import current_rms, voltage_rms
from etb_hil.plant.parameters import Model
from etb_hil.plant.values import ThrottleParameters

Float64 = NDArray[np.float64]
Openings = dict[tuple[int, int], float]  # the current in A that a bridge opens under, by the first and last row of it

_BEFORE = 0.025  # s that an opening lies before samples in which no current is seen to have flown for some time
_HIGH, _LOW = 0.8, 0.5  # of the voltage's limit: the diodes give more than that, a motor that coasts gives less
_FORGOTTEN = 5.0  # time constants of the winding after which a voltage is nothing to its current
_COASTS_FOR, _PARTS = 0.005, 4  # s, and how many of them one after the other, in which a motor is seen to coast
_SURE = 3.0  # times the noise of a mean
_OTHER = 0.3  # of the back-EMF, by which the unit's may be another than the model's


def without_diodes(measured: Measurement, model: Model) -> Measurement:
    """Return a measurement with the mean voltage in the samples in which the bridge opens, which are not judged.

    The current of a throttle is gone after a tenth of a millisecond. What a voltmeter read at the sample's
    beginning, held until the next, would be a blow of the whole supply that the motor never felt.
    """
    if measured.is_drive:
        return measured
    current = measured.current
    opens = _seen_by_voltage(measured, model) if current is None else _seen_by_current(measured, current, model)
    if not opens:
        return measured
    voltage, good = measured.voltage.copy(), measured.is_good.copy()
    for (first, last), flows in opens.items():
        rate = measured.rate / (last + 1 - first)
        voltage[first : last + 1] = _mean(float(voltage[last]), float(voltage[last + 1]), flows, rate, model.values)
        good[first : last + 1] = False
    return replace(measured, voltage=voltage, is_good=good)


def _seen_by_current(measured: Measurement, current: Float64, model: Model) -> Openings:
    """Return the samples that begin with the diodes' voltage against a current (A), with no drive until it is at rest.

    A current that has gone over to the voltage's side by their end was driven there.
    """
    voltage, limit = measured.voltage, model.values.voltage_limit
    is_open, before = open_bridge(measured), round(_BEFORE * measured.rate)
    none = _SURE * current_rms(measured.sensors)
    found = {}
    for first in (np.flatnonzero(is_open[1:] & ~is_open[:-1]) + 1).tolist():
        begin = max(first - before, 0)
        driven = np.flatnonzero(np.abs(voltage[begin:first]) > _LOW * limit)
        if len(driven):
            last = begin + int(driven[-1])
            row, way = _first_of(measured, last), float(np.sign(voltage[last]))
            if abs(voltage[last]) > _HIGH * limit and way * current[row] < 0.0 and way * current[last] < none:
                found[row, last] = float(current[row])
    return found


def _first_of(measured: Measurement, row: int) -> int:
    """Return the first of the rows up to this one that have its reading: a burst's rows have one for all of them."""
    other = np.flatnonzero(commanded(measured)[:row])
    return int(other[-1]) + 1 if len(other) else 0


def _seen_by_voltage(measured: Measurement, model: Model) -> Openings:
    """Return the rows with the diodes' voltage against the current (A) that had been driven, and a coast behind them.

    A bridge that is driven so for a sample strikes the motor: it moves, and the voltage that is set next is not what
    that motion gives.
    """
    size, limit = np.abs(measured.voltage), model.values.voltage_limit
    found = {}
    for row in np.flatnonzero((size[:-1] > _HIGH * limit) & (size[1:] < _LOW * limit)).tolist():
        current = _driven(measured, row, model.values)
        if measured.voltage[row] * current < 0.0 and _coasts(measured, row + 1, model):
            found[row, row] = current
    return found


def _driven(measured: Measurement, row: int, v: ThrottleParameters) -> float:
    """Return the winding's current in A at the beginning of a sample, from the voltages held before it."""
    winding = v.inductance / v.resistance * measured.rate  # samples
    rows = min(math.ceil(_FORGOTTEN * winding), row)
    if rows == 0:
        return 0.0
    back_emf = v.back_emf * (measured.angle[row] - measured.angle[row - rows]) * measured.rate / rows
    left = np.exp(np.arange(-rows, 1) / winding)
    return float(np.diff(left) @ (measured.voltage[row - rows : row] - back_emf)) / v.resistance


def _coasts(measured: Measurement, first: int, model: Model) -> bool:
    """Return whether the voltage from a sample on is what the motion gives, within the sensors' noise."""
    rate, back_emf = measured.rate, model.values.back_emf
    rows = max(round(_COASTS_FOR * rate), 1)
    last = first + rows * _PARTS
    if last >= len(measured):
        return False
    read = 0.5 * (measured.voltage[first:last] + measured.voltage[first + 1 : last + 1])
    given = back_emf * np.diff(measured.angle[first : last + 1 : rows]) * rate / rows
    of_voltage = voltage_rms(measured.sensors) / math.sqrt(rows)
    of_angle = back_emf * measured.angle_noise * math.sqrt(2.0) * rate / rows
    away = np.abs(read.reshape(_PARTS, rows).mean(1) - given)
    return bool(np.all(away < _SURE * np.hypot(of_voltage, of_angle) + _OTHER * np.abs(given)))


def _mean(diodes: float, after: float, current: float, rate: float, v: ThrottleParameters) -> float:
    """Return the voltage's mean in V over a sample: the diodes' until the current is gone, then the motor's own."""
    lasts = v.inductance / v.resistance * math.log1p(v.resistance * abs(current / diodes))
    share = min(lasts * rate, 1.0)
    return share * diodes + (1.0 - share) * after
