"""What rests show of sensors: more noise than stated, and the voltmeter's zero.

At rest a record shows its sensors alone. A true model leaves the noise of the real sensors. If it were underestimated,
the rest would count as a fault of the unit.
"""

from __future__ import annotations

import numpy as np

from etb_hil.discrepancy.measured.measurement import Measurement, current_rms, plate_rms, voltage_rms
from etb_hil.discrepancy.measured.plausibility import is_constant
from etb_hil.discrepancy.measured.sampling import in_blocks, open_bridge
from etb_hil.plant.model_file import Sensors
from etb_hil.plant.parameters import Model
from etb_hil.recording.samples import Bools, Float64

# Decision 0029. Benches with and without such faults: benchmarks/explain_study.py, --view rough_bench.
_BLOCK = 0.05  # s
_RESTS = 10.0  # times the angle's noise within a block that rests
_CALMEST = 0.1  # of the blocks that rest
_CALM = 1.5  # times the noise of those
_LEAST = 0.5  # of what the data sheet says: less noise than that tells no calm from another
_ENOUGH_CALM = 20  # calm blocks: a second
_MORE = 1.1  # times the data sheet, from where it is not the sheet's any more
_NONE = 0.5  # of the current sensor's noise, up to which a block's mean is no current
_ENOUGH_BLOCKS = 5  # without a current: a quarter of a second
_SURE = 6.0  # times the standard error of a zero
_TELLING = 0.1  # of the voltmeter's noise; less is nothing to any balance
_FLOWS = 0.5  # of the current that such a voltage would drive: with as much it is one


def observed_noise(measured: Measurement) -> tuple[Sensors, list[str]]:
    """Return the sensors with the noise seen at rest, where it exceeds the data sheet.

    The second value says so in words.
    """
    m, sheet = measured, measured.sensors
    samples, rests = _resting(m)
    if np.count_nonzero(rests) < _ENOUGH_CALM:
        return sheet, []
    volts = _within(in_blocks(m.voltage, samples))
    calmest = max(float(np.quantile(volts[rests], _CALMEST)), _LEAST * voltage_rms(sheet))
    calm = rests & (volts <= _CALM * calmest)
    if np.count_nonzero(calm) < _ENOUGH_CALM:
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
        # A median: in some blocks a command is too small to be seen.
        seen = float(np.median(_within(in_blocks(values, samples))[calm]))
        if seen > _MORE * promised:
            found[key] = float(np.sqrt(max(seen**2 - step**2 / 12.0, 0.0)))
            more = f"{1e3 * seen:.3g} m{unit} rms at rest, where the model file's sensors have {1e3 * promised:.3g}"
            said.append(f"{role} has a noise of {more}: the analysis uses the observed noise")
    return sheet.model_copy(update=found), said


def _within(blocks: Float64) -> Float64:
    """Return the rms noise (count) of blocks (count, samples) by second differences."""
    return np.asarray(np.sqrt(np.mean(np.diff(blocks, 2, axis=1) ** 2, axis=1) / 6.0))


def voltage_zero(measured: Measurement, model: Model) -> float:
    """Return the voltmeter's reading (V) at rest without current; 0 if it is not seen.

    At rest and zero current the voltage is zero, whether the bridge is off or commands nothing. The median over blocks
    is taken: a few of them may hold a command too small to move anything.
    """
    m = measured
    if m.current is None or is_constant(m.voltage, m.sensors):  # a supply's column: its 13.5 V are no zero
        return 0.0
    samples, rests = _resting(m)
    amperes = in_blocks(m.current, samples).mean(axis=1)
    is_none = in_blocks(open_bridge(m), samples).all(axis=1) & (np.abs(amperes) < _NONE * current_rms(m.sensors))
    rests &= is_none
    if np.count_nonzero(rests) < _ENOUGH_BLOCKS:
        return 0.0
    volts = in_blocks(m.voltage, samples)[rests].mean(axis=1)
    zero = float(np.median(volts))
    noise = max(voltage_rms(m.sensors) / np.sqrt(samples), float(np.median(np.abs(volts - zero))))
    drives = zero / model.values.resistance
    flows = float(np.median(amperes[rests]))
    is_driven = abs(flows) > _FLOWS * abs(drives) and flows * drives > 0.0
    is_sure = abs(zero) > max(_SURE * noise / np.sqrt(len(volts)), _TELLING * voltage_rms(m.sensors))
    return zero if is_sure and not is_driven else 0.0


def _resting(m: Measurement) -> tuple[int, Bools]:
    """Return the samples of a block, and which blocks rest.

    One rests if all is good and the angle is within its noise.
    """
    samples = max(round(_BLOCK * m.rate), 8)
    stays = np.ptp(in_blocks(m.angle, samples), axis=1) <= _RESTS * m.angle_noise
    return samples, in_blocks(m.is_good, samples).all(axis=1) & stays
