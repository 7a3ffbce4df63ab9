"""Sensors with more noise than their data sheet states, as rests show it.

A true model leaves the noise of the real sensors. If it were underestimated, the rest would count as a fault of the
unit.
"""

from __future__ import annotations

import numpy as np

from etb_hil.discrepancy.measured.measurement import Measurement, current_rms, plate_rms, voltage_rms
from etb_hil.discrepancy.measured.repair.rest_blocks import Blocks
from etb_hil.plant.model_file import Sensors
from etb_hil.recording.samples import Float64

# Decision 0029. Benches with and without such faults: benchmarks/explain_study.py, --view rough_bench.
_CALMEST = 0.1  # of the blocks that rest
_CALM = 1.5  # times the noise of those
_LEAST = 0.5  # of what the data sheet says: less noise than that tells no calm from another
_ENOUGH = 20  # calm blocks: a second
_MORE = 1.1  # times the data sheet, from where it is not the sheet's any more


def observed_noise(measured: Measurement) -> tuple[Sensors, list[str]]:
    """Return the sensors with the noise seen at rest, where it exceeds the data sheet.

    The second value says so in words.
    """
    m, sheet = measured, measured.sensors
    blocks = Blocks.of(m)
    if np.count_nonzero(blocks.rests) < _ENOUGH:
        return sheet, []
    volts = _within(blocks.cut(m.voltage))
    calmest = max(float(np.quantile(volts[blocks.rests], _CALMEST)), _LEAST * voltage_rms(sheet))
    calm = blocks.rests & (volts <= _CALM * calmest)
    if np.count_nonzero(calm) < _ENOUGH:
        return sheet, []
    found, said = {}, []
    plate = m.angle if m.is_plates else m.plate
    for key, role, unit, values, promised, step in (
        ("voltage_noise", "motor_voltage", "V", m.voltage, voltage_rms(sheet), sheet.voltage_step),
        ("current_noise", "motor_current", "A", m.current, current_rms(sheet), sheet.current_step),
        ("plate_noise", "throttle_angle", "rad", plate, plate_rms(sheet), sheet.plate_range / 2**sheet.plate_bits),
    ):
        if values is None:
            continue
        seen = float(np.median(_within(blocks.cut(values))[calm]))  # in some a command is too small to be seen
        if seen > _MORE * promised:
            found[key] = float(np.sqrt(max(seen**2 - step**2 / 12.0, 0.0)))
            more = f"{1e3 * seen:.3g} m{unit} rms at rest, where the model file's sensors have {1e3 * promised:.3g}"
            said.append(f"{role} has a noise of {more}: the analysis uses the observed noise")
    return sheet.model_copy(update=found), said


def _within(blocks: Float64) -> Float64:
    """Return the rms noise (count) of blocks (count, samples) by second differences."""
    return np.asarray(np.sqrt(np.mean(np.diff(blocks, 2, axis=1) ** 2, axis=1) / 6.0))
