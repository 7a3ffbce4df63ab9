"""Measurements as the filter of the estimation core takes them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.sampling import open_bridge
from etb_hil.estimation.kalman import NOISE_VOLTAGE
from etb_hil.estimation.record import Record, record
from etb_hil.plant.parameters import Model


def as_record(measured: Measurement, model: Model) -> Record:
    """Return a measurement as the filter takes it.

    Its sensors are as good as the record shows. The force of a drive stands where a throttle has its voltage: a drive's
    winding has 1 ohm and no lag.
    """
    model = replace(model, sensors=measured.sensors)
    if measured.is_drive:
        time = np.arange(len(measured), dtype=np.float64) * measured.dt
        made = record(time, measured.voltage, model, motor=measured.angle)
        made.settings[NOISE_VOLTAGE] = measured.sensors.current_noise**2
        return made
    motor, plate = measured.motor_and_plate
    is_alone = measured.is_plates and measured.encoder is None
    # The voltage of an open bridge follows the back-EMF, and that of a bad sample may be any.
    unsure = np.where(open_bridge(measured) | ~measured.is_good, model.values.voltage_limit**2, 0.0)
    return record(
        np.arange(len(measured), dtype=np.float64) * measured.dt, measured.voltage, model, current=measured.current,
        motor=None if is_alone else motor, plate=measured.angle if is_alone else plate,
        temperature=measured.temperature, unsure=unsure,
    )  # fmt: skip
