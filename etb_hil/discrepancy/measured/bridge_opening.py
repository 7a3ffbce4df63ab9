"""Repair of samples in which a bridge opens and its diodes conduct for a part."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from etb_hil.discrepancy.measured.measurement import Measurement, current_rms, voltage_rms
from etb_hil.discrepancy.measured.sampling import commanded, open_bridge
from etb_hil.plant.parameters import Model
from etb_hil.plant.values import ThrottleParameters
from etb_hil.recording.samples import Float64

# The current in A that a bridge opens under, by the first and last sample of it.
Openings = dict[tuple[int, int], float]

_BEFORE = 0.025  # s that an opening lies before samples in which no current is seen to have flown for some time
_HIGH, _LOW = 0.8, 0.5  # of the voltage's limit: the diodes give more than that, a motor that coasts gives less
_FORGOTTEN = 5.0  # time constants of the winding after which a voltage is nothing to its current
_COASTS_FOR, _PARTS = 0.005, 4  # s, and how many of them one after the other, in which a motor is seen to coast
_SURE = 3.0  # times the noise of a mean
_OTHER = 0.3  # of the back-EMF, by which the unit's may be another than the model's


def without_diodes(measured: Measurement, model: Model) -> Measurement:
    """Return a measurement with the mean voltage in samples in which the bridge opens.

    These samples are not judged. The current of a throttle has decayed after a tenth of a millisecond. A voltmeter
    reading at the sample's beginning, held until the next, would be a pulse of the whole supply that the motor never
    got.
    """
    if not measured.device.is_throttle:
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
    """Return the samples that begin with diode voltage against a current (A).

    No drive follows until the current is zero. A current that has changed sign by the sample's end was driven, not
    freewheeling.
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
            sample, way = _first_of(measured, last), float(np.sign(voltage[last]))
            if abs(voltage[last]) > _HIGH * limit and way * current[sample] < 0.0 and way * current[last] < none:
                found[sample, last] = float(current[sample])
    return found


def _first_of(measured: Measurement, sample: int) -> int:
    """Return the first sample that has the same reading as this one, as in a burst."""
    other = np.flatnonzero(commanded(measured)[:sample])
    return int(other[-1]) + 1 if len(other) else 0


def _seen_by_voltage(measured: Measurement, model: Model) -> Openings:
    """Return the samples with diode voltage against the driven current (A).

    A coast follows. A bridge that is driven so for a sample strikes the motor: it moves, and the next voltage is not
    the back-EMF of that motion.
    """
    size, limit = np.abs(measured.voltage), model.values.voltage_limit
    found = {}
    for sample in np.flatnonzero((size[:-1] > _HIGH * limit) & (size[1:] < _LOW * limit)).tolist():
        current = _driven(measured, sample, model.values)
        if measured.voltage[sample] * current < 0.0 and _coasts(measured, sample + 1, model):
            found[sample, sample] = current
    return found


def _driven(measured: Measurement, sample: int, v: ThrottleParameters) -> float:
    """Return the winding's current (A) at a sample's beginning, by earlier voltages."""
    winding = v.inductance / v.resistance * measured.rate  # samples
    samples = min(math.ceil(_FORGOTTEN * winding), sample)
    if samples == 0:
        return 0.0
    back_emf = v.back_emf * (measured.angle[sample] - measured.angle[sample - samples]) * measured.rate / samples
    left = np.exp(np.arange(-samples, 1) / winding)
    return float(np.diff(left) @ (measured.voltage[sample - samples : sample] - back_emf)) / v.resistance


def _coasts(measured: Measurement, first: int, model: Model) -> bool:
    """Tell whether the voltage from a sample on is the back-EMF, within the noise."""
    rate, back_emf = measured.rate, model.values.back_emf
    samples = max(round(_COASTS_FOR * rate), 1)
    last = first + samples * _PARTS
    if last >= len(measured):
        return False
    read = 0.5 * (measured.voltage[first:last] + measured.voltage[first + 1 : last + 1])
    given = back_emf * np.diff(measured.angle[first : last + 1 : samples]) * rate / samples
    of_voltage = voltage_rms(measured.sensors) / math.sqrt(samples)
    of_angle = back_emf * measured.angle_noise * math.sqrt(2.0) * rate / samples
    away = np.abs(read.reshape(_PARTS, samples).mean(1) - given)
    return bool(np.all(away < _SURE * np.hypot(of_voltage, of_angle) + _OTHER * np.abs(given)))


def _mean(diodes: float, after: float, current: float, rate: float, v: ThrottleParameters) -> float:
    """Return the mean voltage (V) of a sample: diodes until zero current, then EMF."""
    lasts = v.inductance / v.resistance * math.log1p(v.resistance * abs(current / diodes))
    share = min(lasts * rate, 1.0)
    return share * diodes + (1.0 - share) * after
