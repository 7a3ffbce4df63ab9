"""A record as the filter takes it: inputs, readings, and their noise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.estimation import kalman
from etb_hil.plant.model_file import Sensors
from etb_hil.plant.parameters import Model
from etb_hil.recording.samples import Float64

_JITTER = 1e-6  # s rms between a sample's time and its stamp, where nothing else is known
_JUMP = 0.1  # share of the limp-home jump by which a spring's torque may be another near it (explain.md, section 1)


@dataclass(frozen=True, slots=True)
class Record:
    """A segment of samples without gaps: columns (n) in SI.

    Angles are at the throttle shaft.

    `dt`: s to the next sample; `voltage`: V, held as long; `temperature`: degC; `readings` (n, 3): current, motor's and
    plate's angle, NaN where there is none. `settings`: see `kalman`; the two disturbances and the multiples of the
    noise are set for each run.
    """

    dt: Float64
    voltage: Float64
    temperature: Float64
    readings: Float64
    settings: Float64

    def __len__(self) -> int:
        return len(self.dt)

    @property
    def time(self) -> Float64:
        """Time in s since the first sample (n)."""
        return np.concatenate([[0.0], np.cumsum(self.dt[:-1])])

    def part(self, rows: slice) -> Record:
        """Return some of the samples that follow each other."""
        dt, voltage, temperature = self.dt[rows], self.voltage[rows], self.temperature[rows]
        return Record(dt, voltage, temperature, self.readings[rows], self.settings)


def record(
    time: Float64,
    voltage: Float64,
    model: Model,
    *,
    current: Float64 | None = None,
    motor: Float64 | None = None,
    plate: Float64 | None = None,
    temperature: Float64 | float = 25.0,
) -> Record:
    """Return a record of columns (n) in SI.

    Time is in s, angles are at the throttle shaft, temperature is in degC.

    The noise is that of the model file's sensors. InputError where the time does not grow, or no angle was read.
    """
    if motor is None and plate is None:
        raise InputError(Problem("an estimate needs an angle", remedy="record the motor's or the plate's"))
    steps = np.diff(time)
    if len(time) < 2 or not np.all(steps > 0.0):
        raise InputError(
            Problem("the time of a record must grow from sample to sample", allowed="at least two samples")
        )
    none = np.full(len(time), np.nan)
    readings = np.column_stack([none if one is None else one for one in (current, motor, plate)])
    column = np.broadcast_to(np.asarray(temperature, float), (len(time),)).copy()
    settings = noise_settings(model.sensors, model.values.gear_ratio, model.tolerance("limp_home"))
    return Record(np.append(steps, steps[-1]), np.asarray(voltage, float), column, readings, settings)


def noise_settings(sensors: Sensors, gear_ratio: float, limp_home: float) -> Float64:
    """Return the filter's settings (`kalman.SETTINGS`) by a data sheet.

    `limp_home` is how far in rad that may be off.
    """
    s = np.zeros(kalman.SETTINGS)
    s[kalman.NOISE_CURRENT] = sensors.current_noise**2 + sensors.current_step**2 / 12.0
    s[kalman.STEP_MOTOR] = 2.0 * math.pi / sensors.motor_counts_per_turn / gear_ratio
    s[kalman.STEP_PLATE] = sensors.plate_range / 2**sensors.plate_bits
    s[kalman.NOISE_PLATE] = sensors.plate_noise**2
    s[kalman.LASTS_MOTOR] = 1.0
    # How much of a rounding error noise leaves standing: the first harmonic of the rounding's sawtooth, squared.
    s[kalman.LASTS_PLATE] = math.exp(-4.0 * math.pi**2 * s[kalman.NOISE_PLATE] / s[kalman.STEP_PLATE] ** 2)
    s[kalman.NOISE_VOLTAGE] = sensors.voltage_noise**2 + sensors.voltage_step**2 / 12.0
    s[kalman.JITTER], s[kalman.JUMP], s[kalman.NEAR] = _JITTER, _JUMP, limp_home
    s[kalman.SCALE :] = 1.0
    return s
