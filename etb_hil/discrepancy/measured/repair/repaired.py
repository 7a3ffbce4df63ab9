"""All repairs of a record's sensors and samples, in their order."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from etb_hil.discrepancy.measured.measurement import SLOWEST, Measurement, plate_rms
from etb_hil.discrepancy.measured.repair.coasting import commanded_coasts
from etb_hil.discrepancy.measured.repair.rests import observed_noise, voltage_zero
from etb_hil.discrepancy.measured.repair.spikes import without_spikes
from etb_hil.discrepancy.measured.repair.voltage_shift import voltage_shift
from etb_hil.plant.parameters import Model


def repaired(measured: Measurement, model: Model) -> Measurement:
    """Return a measurement of a winding without sensor errors; its flags say which."""
    if not measured.device.has_winding or measured.rate < SLOWEST:
        return measured
    m = _with_its_noise(measured)
    m = _coasting(m, model)  # a winding whose voltage is not its own would keep samples and spikes from being judged
    m = _in_step(m)  # a current that goes with another sample's voltage would be no winding's
    m = _without_spikes(m)
    return _from_its_zero(m, model)


def _without_spikes(m: Measurement) -> Measurement:
    found = without_spikes(m)
    if not found:
        return m
    columns: dict[str, Any] = {name: values for name, (values, _) in found.items()}
    said = []
    for name, (_, count) in found.items():
        what = (
            f"1 single value of {m.role(name)} jumps" if count == 1 else f"{count} single values of {m.role(name)} jump"
        )
        said.append(f"{what} away and back faster than a motor can: the analysis interpolates there")
    return replace(m, flags=(*m.flags, *said), **columns)


def _with_its_noise(m: Measurement) -> Measurement:
    sensors, said = observed_noise(m)
    noise = plate_rms(sensors) if m.is_plates else m.angle_noise
    return replace(m, sensors=sensors, angle_noise=noise, flags=(*m.flags, *said)) if said else m


def _coasting(m: Measurement, model: Model) -> Measurement:
    found = commanded_coasts(m, model)
    if found is None:
        return m
    voltage, samples = found
    seconds = f"{float(np.count_nonzero(samples)) * m.dt:.2g} s"
    what = f"motor_voltage is 0 V while the motor turns with the bridge off ({seconds}): a command, not a measurement"
    said = f"{what}; the analysis uses the back-EMF there and does not judge it"
    return replace(m, voltage=voltage, is_good=m.is_good & ~samples, flags=(*m.flags, said))


def _from_its_zero(m: Measurement, model: Model) -> Measurement:
    zero = voltage_zero(m, model)
    if zero == 0.0:
        return m
    said = f"motor_voltage is {1e3 * zero:.3g} mV at zero current and at rest: the analysis subtracts that offset"
    return replace(m, voltage=m.voltage - zero, flags=(*m.flags, said))


def _in_step(m: Measurement) -> Measurement:
    late = voltage_shift(m)
    if late == 0:
        return m
    voltage, is_good = m.voltage.copy(), m.is_good.copy()
    if late > 0:
        voltage[:-late] = m.voltage[late:]
        is_good[-late:] = False
    else:
        voltage[-late:] = m.voltage[:late]
        is_good[:-late] = False
    sample, way = "sample" if abs(late) == 1 else "samples", "late" if late > 0 else "early"
    answers = "before" if late > 0 else "after"
    what = f"motor_voltage is {abs(late)} {sample} ({1e3 * abs(late) * m.dt:.2g} ms) {way}"
    said = f"{what}: the current responds that long {answers} each step; the analysis corrects the time offset"
    return replace(m, voltage=voltage, is_good=is_good, flags=(*m.flags, said))
