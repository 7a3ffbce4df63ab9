"""Sensors of the controller, reading the plant.

A reading has noise, steps and ranges of the unit's data sheet.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.compiled import njit
from etb_hil.controller.noise import CURRENT, TRACK, TRACK_2, VOLTAGE, generator, normal
from etb_hil.controller.state import DataSheet, record
from etb_hil.plant.model_file import Sensors

# The tracks begin this far below the closed stop, so that a plate pressed on a stop still shows.
TRACK_BELOW_STOP = math.radians(2.5)


def data_sheet(sensors: Sensors, gear_ratio: float, start_angle: float, seed: int) -> NDArray[np.void]:
    """Return the record (1) of a unit's sensors at power-on.

    The plate is at `start_angle` (rad) then.
    """
    sheet = record(DataSheet)
    rng = generator(seed, 1)
    step = sensors.plate_range / 2**sensors.plate_bits
    low = -round(TRACK_BELOW_STOP / step) * step
    sheet["encoder_step"] = 2.0 * math.pi / sensors.motor_counts_per_turn
    sheet["encoder_phase"] = rng.random()
    sheet["encoder_zero"] = start_angle * gear_ratio
    sheet["track_step"] = step
    sheet["track_low"] = low
    sheet["track_high"] = low + sensors.plate_range - step
    sheet["track_noise"] = sensors.plate_noise
    sheet["current_step"] = sensors.current_step
    sheet["current_noise"] = sensors.current_noise
    sheet["voltage_step"] = sensors.voltage_step
    sheet["voltage_noise"] = sensors.voltage_noise
    sheet["seed"] = rng.integers(2**62)
    return sheet


@njit(cache=True, error_model="numpy")
def rounded(value: float, step: float) -> float:
    """Return the multiple of a converter's step that is nearest to a value."""
    return math.floor(value / step + 0.5) * step


@njit(cache=True, error_model="numpy")
def encoder_angle(motor_angle: float, sheet: DataSheet) -> float:
    """Return the motor encoder's reading in rad since power-on.

    The reading has whole counts, and no noise.
    """
    counts = math.floor((motor_angle - sheet.encoder_zero) / sheet.encoder_step + sheet.encoder_phase)
    return counts * sheet.encoder_step


@njit(cache=True, error_model="numpy")
def track_angles(theta: float, counter: int, sheet: DataSheet) -> tuple[float, float]:
    """Return both plate tracks in rad.

    The second one falls as the plate opens and is given as the angle it means.
    """
    one = rounded(theta + normal(sheet.seed, counter, TRACK) * sheet.track_noise, sheet.track_step)
    noise = normal(sheet.seed, counter, TRACK_2) * sheet.track_noise
    two = -rounded(-theta - sheet.track_2_offset + noise, sheet.track_step)
    low, high = sheet.track_low, sheet.track_high
    return min(max(one, low), high), min(max(two, low), high)


@njit(cache=True, error_model="numpy")
def measured_current(current: float, counter: int, sheet: DataSheet) -> float:
    """Return the reading of the current sensor in A."""
    return rounded(current + normal(sheet.seed, counter, CURRENT) * sheet.current_noise, sheet.current_step)


@njit(cache=True, error_model="numpy")
def measured_voltage(voltage: float, counter: int, sheet: DataSheet) -> float:
    """Return the reading of the voltage at the motor's terminals in V."""
    return rounded(voltage + normal(sheet.seed, counter, VOLTAGE) * sheet.voltage_noise, sheet.voltage_step)
