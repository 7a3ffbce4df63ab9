"""Repair of a logged command in place of a measured voltage during a coast.

A coasting motor shows its back-EMF at open terminals, which a voltmeter reads. A log of commands has 0 V there.
"""

from __future__ import annotations

import math

import numpy as np

from etb_hil.discrepancy.measured.measurement import Measurement, current_rms, voltage_rms
from etb_hil.discrepancy.measured.sampling import open_bridge
from etb_hil.plant.parameters import Model
from etb_hil.recording.samples import Bools, Float64

_NONE = 4.0  # times a sensor's noise, up to which a voltage or a current is none
_TURNS = 10.0  # times the voltmeter's noise: the back-EMF of a motor that is sure to turn
_COASTS = 3.0  # times it, from where it is missed
_ENOUGH = 0.02  # s
_NEARLY_ALL = 0.9  # of the samples


def commanded_coasts(measured: Measurement, model: Model) -> tuple[Float64, Bools] | None:
    """Return the back-EMF of coasts that nearly all have 0 V; None otherwise.

    That is the voltage (n, V) with it, and the samples (n) that are not judged.

    Until the current has decayed, an opened bridge shows its diode voltage, which is no commanded voltage either.
    """
    m, current = measured, measured.current
    if current is None:
        return None
    least, back_emf = voltage_rms(m.sensors), model.values.back_emf
    given = back_emf * _velocity(m, least / back_emf)
    is_none, is_open = np.abs(m.voltage) <= _NONE * least, open_bridge(m)
    sure = is_open & (np.abs(given) > _TURNS * least)
    if np.count_nonzero(sure) < _ENOUGH * m.rate or np.mean(is_none[sure]) < _NEARLY_ALL:
        return None
    is_off = _around(is_none, is_open)
    flows = np.abs(current) > _NONE * current_rms(m.sensors)
    coasts = is_off & ~flows & (np.abs(given) > _COASTS * least)
    return np.where(coasts, given, m.voltage), coasts | (is_off & flows)


def _around(wide: Bools, narrow: Bools) -> Bools:
    """Return the runs of samples (n) of `wide` that contain any of `narrow`."""
    found = np.zeros(len(wide), np.bool_)
    for first, last in np.flatnonzero(np.diff(wide, prepend=False, append=False)).reshape(-1, 2).tolist():
        found[first:last] = narrow[first:last].any()
    return found


def _velocity(m: Measurement, noise: float) -> Float64:
    """Return the velocity (n, rad/s) over as few samples as keep it below `noise`."""
    half = math.ceil(m.angle_noise * m.rate / (math.sqrt(2.0) * noise))
    samples = np.arange(len(m))
    before, after = np.maximum(samples - half, 0), np.minimum(samples + half, len(m) - 1)
    return np.asarray((m.angle[after] - m.angle[before]) / ((after - before) * m.dt))
