"""Measurements as the filter of the estimation core takes them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.measured.decimation import at_least
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.sampling import back_emf_alone, open_bridge
from etb_hil.estimation.kalman import NOISE_VOLTAGE
from etb_hil.estimation.record import Record, record
from etb_hil.plant.parameters import Model
from etb_hil.recording.samples import Float64

# Hz. A pass of the filter costs as much a sample at any rate, and so many samples at 1 kHz are of twice the motion that
# they are of at 2 kHz (`python benchmarks/explain_study.py strong FIRST COUNT`).
_ENOUGH = 1000.0


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
    no_current = open_bridge(measured) | back_emf_alone(measured, model.values.back_emf)
    unsure = np.where(no_current, np.inf, np.where(bad, model.values.voltage_limit**2, 0.0))
    made = record(
        time, measured.voltage, model, current=current, motor=motor, plate=plate, temperature=measured.temperature,
        unsure=unsure,
    )  # fmt: skip
    # Rounding stays: of a voltage that is held it is the same every time.
    made.settings[NOISE_VOLTAGE] -= measured.sensors.voltage_noise**2 * (1.0 - 1.0 / averaged)
    return replace(made, sampled=sampled)


def _read(values: Float64 | None, bad: NDArray[np.bool_]) -> Float64 | None:
    """Return readings without those of bad samples, which were bridged."""
    return None if values is None else np.where(bad, np.nan, values)
