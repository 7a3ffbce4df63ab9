"""Noise and resolution of a sensor by its data sheet, combined."""

from __future__ import annotations

import numpy as np

from etb_hil.plant.model_file import Sensors


def voltage_rms(sensors: Sensors) -> float:
    """Return the voltmeter's noise and rounding, rms, in V."""
    return float(np.hypot(sensors.voltage_noise, sensors.voltage_step / np.sqrt(12.0)))


def current_rms(sensors: Sensors) -> float:
    """Return the current sensor's noise and rounding, rms, in A."""
    return float(np.hypot(sensors.current_noise, sensors.current_step / np.sqrt(12.0)))


def plate_rms(sensors: Sensors) -> float:
    """Return the plate sensor's noise and rounding, rms, in rad."""
    return float(np.hypot(sensors.plate_noise, sensors.plate_range / 2**sensors.plate_bits / np.sqrt(12.0)))
