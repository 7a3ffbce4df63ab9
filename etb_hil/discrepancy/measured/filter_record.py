"""Measurements as the filter of the estimation core takes them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.measured.decimation import at_least
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.sampling import open_bridge
from etb_hil.estimation.kalman import NOISE_VOLTAGE
from etb_hil.estimation.record import Record, record
from etb_hil.plant.parameters import Model
from etb_hil.recording.samples import Float64

# Hz. A pass of the filter costs as much a sample at any rate, and so many samples at 1 kHz are of twice the motion that
# they are of at 2 kHz (`python benchmarks/explain_study.py strong FIRST COUNT`).
_ENOUGH = 1000.0


_QUIET_FOR = 0.02  # s
_ZERO = 0.1  # A, of a Hall sensor
_OTHER = 0.05  # of the back-EMF, by which the unit's may be another than the model's


def as_record(measured: Measurement, model: Model) -> Record:
    """Return a measurement as the filter takes it, at the rate that it needs.

    Its sensors are as good as the record shows. A force, or a current that is imposed, stands where a winding has its
    voltage: it has 1 ohm and no lag then.
    """
    sampled, measured = measured.dt, at_least(_ENOUGH, measured)
    averaged = measured.dt / sampled  # voltages in one
    model, bad = replace(model, sensors=measured.sensors), ~measured.is_good
    time = np.arange(len(measured), dtype=np.float64) * measured.dt
    if not measured.device.has_winding:
        unsure = np.where(bad, np.max(np.square(measured.voltage)), 0.0)
        made = record(time, measured.voltage, model, motor=_read(measured.angle, bad), unsure=unsure)
        made.settings[NOISE_VOLTAGE] = measured.sensors.current_noise**2 / averaged
        return replace(made, is_read=True, sampled=sampled)
    current, motor, plate = (_read(one, bad) for one in (measured.current, *measured.motor_and_plate))
    # The voltage of a bad sample may be any.
    no_current = open_bridge(measured) | _carries_none(measured, model)
    unsure = np.where(no_current, np.inf, np.where(bad, model.values.voltage_limit**2, 0.0))
    made = record(
        time, measured.voltage, model, current=current, motor=motor, plate=plate, temperature=measured.temperature,
        unsure=unsure,
    )  # fmt: skip
    # Rounding stays: of a voltage that is held it is the same every time.
    made.settings[NOISE_VOLTAGE] -= measured.sensors.voltage_noise**2 * (1.0 - 1.0 / averaged)
    return replace(made, sampled=sampled)


def _carries_none(measured: Measurement, model: Model) -> NDArray[np.bool_]:
    """Return where (n) no current flows: the voltage is the back-EMF alone.

    The current is quiet there, and no larger than zeros are.
    """
    if measured.current is None:
        return np.zeros(len(measured), np.bool_)
    width = max(3, round(_QUIET_FOR * measured.rate))

    def mean(values: Float64) -> Float64:
        return np.convolve(values, np.full(width, 1.0 / width), "same")

    current, sensors = mean(measured.current), measured.sensors
    spread = np.sqrt(np.maximum(mean(measured.current**2) - current**2, 0.0))
    back_emf = model.values.back_emf * mean(np.gradient(measured.angle) * measured.rate)
    noise = np.hypot(sensors.voltage_noise, sensors.voltage_step) / np.sqrt(width)
    is_quiet = spread < 2.0 * np.hypot(sensors.current_noise, sensors.current_step)
    is_back_emf = np.abs(mean(measured.voltage) - back_emf) < _OTHER * np.abs(back_emf) + 3.0 * noise
    return is_quiet & (np.abs(current) < _ZERO) & is_back_emf


def _read(values: Float64 | None, bad: NDArray[np.bool_]) -> Float64 | None:
    """Return readings without those of bad samples, which were bridged."""
    return None if values is None else np.where(bad, np.nan, values)
