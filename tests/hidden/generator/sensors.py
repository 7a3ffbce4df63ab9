"""The data sheet of the rig: what its sensors make of the true record."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from generator import layout as at
from generator.bench import CONTROL_PERIOD
from generator.play import play


@dataclass(frozen=True)
class Sensors:
    """Steps, noise (rms) and jitter of the signals, SI."""

    motor_counts: int = 16384
    plate_step: float = float(np.radians(90.0) / 4096.0)
    plate_noise: float = float(np.radians(0.01))
    current_step: float = 1e-3
    current_noise: float = 5e-3
    voltage_step: float = 10e-3
    voltage_noise: float = 20e-3
    temperature_step: float = 0.1
    jitter: float = 2e-6


ROLES = ("time", "motor_voltage", "motor_current", "motor_angle", "throttle_angle", "temperature", "supply_voltage")


def measure(rows, rate, inputs, p, e, sensors, rng):
    """Sample the true record at `rate`, Hz: a dict of columns by role, SI (temperature in degC).

    `rows` may be finer than `rate` by a whole number, which what is late needs.
    """
    fine = round(len(rows) / (len(inputs) * rate * CONTROL_PERIOD))
    current = _current(rows[:, at.LOG_CURRENT], rate * fine, inputs, e)[::fine]
    motor = _angle(rows[:, at.LOG_ANGLE], rate * fine, e, at.MOTOR_DELAY)[::fine]
    plate = _angle(rows[:, at.LOG_PLATE], rate * fine, e, at.PLATE_DELAY)[::fine]
    rows = rows[::fine]
    count = len(rows)
    late = np.clip(rng.normal(0.0, sensors.jitter, count), -4.0 * sensors.jitter, 4.0 * sensors.jitter)
    slipped = rng.uniform(size=(2, 12))
    noise = rng.standard_normal((4, count))
    warm = np.repeat(inputs[:, at.IN_TEMPERATURE], max(1, round(rate * CONTROL_PERIOD)))[:count]
    motor = p[at.N] * (motor + rows[:, at.LOG_VELOCITY] * late)
    motor = _motor_angle(motor, slipped, e)
    plate = _plate_angle(plate + rows[:, at.LOG_PLATE_VELOCITY] * late, e)
    grid = 2.0 * np.pi / sensors.motor_counts
    return {
        "time": np.arange(count) / rate,
        "motor_voltage": _rounded(rows[:, at.LOG_COMMAND] + sensors.voltage_noise * noise[0], sensors.voltage_step),
        "motor_current": _rounded(
            current + rows[:, at.LOG_CURRENT_RATE] * late + sensors.current_noise * noise[1], sensors.current_step
        ),
        "motor_angle": np.floor(motor / grid) * grid,
        "throttle_angle": _rounded(plate + sensors.plate_noise * noise[2], sensors.plate_step),
        "temperature": _rounded(warm + 0.5 * sensors.temperature_step * noise[3], sensors.temperature_step),
        "supply_voltage": _rounded(
            rows[:, at.LOG_SUPPLY] + sensors.voltage_noise * rng.standard_normal(count), sensors.voltage_step
        ),
    }


def _rounded(values, step):
    return np.round(values / step) * step + 0.0  # and no minus zero


def _late(values, rate, row):
    """A signal that was constant before its first value: delayed, or behind a filter of the first order."""
    if row[at.STRENGTH] == 0.0:
        return values
    if row[at.FORM] == 1.0:
        keep = np.exp(-1.0 / (rate * row[at.STRENGTH]))
        return values[0] + lfilter([1.0 - keep], [1.0, -keep], values - values[0])
    t = np.arange(values.size) / rate
    return np.interp(t - row[at.STRENGTH], t, values)


def _angle(angle, rate, e, own):
    """An angle that is late as all are, and by its own row of the effects' table."""
    return _late(_late(angle, rate, e[at.ANGLE_DELAY]), rate, e[own])


def _current(current, rate, inputs, e):
    """The current as its amplifier gives it: late, scaled, shifted or bent."""
    current = _late(current, rate, e[at.DELAY])
    current = current + e[at.CURRENT_CURVATURE, at.STRENGTH] * current * np.abs(current)
    current = current * (1.0 + e[at.CURRENT_GAIN, at.STRENGTH])
    row = e[at.CURRENT_OFFSET]
    if row[at.FORM] == 1.0:
        drift = np.interp(
            np.arange(current.size) / rate, np.arange(len(inputs)) * CONTROL_PERIOD, inputs[:, at.IN_TEMPERATURE]
        )
        return current + row[at.STRENGTH] * (1.0 + 0.01 * (drift - 25.0))
    return current + row[at.STRENGTH]


def _motor_angle(angle, slipped, e):
    row = e[at.ECCENTRICITY]
    if row[at.STRENGTH] != 0.0:
        phase = angle + row[at.A]
        wave = np.sin(phase) if row[at.FORM] == 0.0 else 0.85 * np.sin(phase) + 0.35 * np.sin(2.0 * phase + 0.7)
        angle = angle + row[at.STRENGTH] * wave
    row = e[at.SLIP]
    if row[at.STRENGTH] != 0.0:
        # The logger loses counts where it moves: steps of either sign that stay.
        at_rows = np.sort((slipped[0] * angle.size).astype(int))
        steps = np.zeros(angle.size)
        np.add.at(steps, at_rows, row[at.STRENGTH] * np.where(slipped[1] < row[at.A], 1.0, -1.0))
        angle = angle + np.cumsum(steps)
    return angle


def _plate_angle(angle, e):
    row = e[at.PLATE_HYSTERESIS]
    if row[at.STRENGTH] != 0.0:
        angle = play(angle, row[at.STRENGTH], row[at.FORM])
    row = e[at.PLATE_CURVATURE]
    if row[at.STRENGTH] != 0.0:
        angle = angle + row[at.STRENGTH] * np.sin(row[at.A] * angle + row[at.B])
    return angle
