"""The zero offset of a voltmeter, as rests show it."""

from __future__ import annotations

import numpy as np

from etb_hil.discrepancy.measured.measurement import Measurement, current_rms, voltage_rms
from etb_hil.discrepancy.measured.plausibility import is_constant
from etb_hil.discrepancy.measured.repair.rest_blocks import Blocks
from etb_hil.discrepancy.measured.sampling import open_bridge
from etb_hil.plant.parameters import Model

# Decision 0029. Benches with and without such faults: benchmarks/explain_study.py, --view rough_bench.
_NONE = 0.5  # of the current sensor's noise, up to which a block's mean is no current
_ENOUGH = 5  # blocks: a quarter of a second
_SURE = 6.0  # times its standard error
_TELLING = 0.1  # of the voltmeter's noise; less is nothing to any balance
_FLOWS = 0.5  # of the current that such a voltage would drive: with as much it is one


def voltage_zero(measured: Measurement, model: Model) -> float:
    """Return the voltmeter's reading (V) at rest without current; 0 if it is not seen.

    At rest and zero current the voltage is zero, whether the bridge is off or commands nothing. The median over blocks
    is taken: a few of them may hold a command too small to move anything.
    """
    m = measured
    if m.current is None or is_constant(m.voltage, m.sensors):  # a supply's column: its 13.5 V are no zero
        return 0.0
    blocks = Blocks.of(m)
    amperes = blocks.cut(m.current).mean(axis=1)
    is_none = blocks.cut(open_bridge(m)).all(axis=1) & (np.abs(amperes) < _NONE * current_rms(m.sensors))
    rests = blocks.rests & is_none
    if np.count_nonzero(rests) < _ENOUGH:
        return 0.0
    volts = blocks.cut(m.voltage)[rests].mean(axis=1)
    zero = float(np.median(volts))
    noise = max(voltage_rms(m.sensors) / np.sqrt(blocks.samples), float(np.median(np.abs(volts - zero))))
    drives = zero / model.values.resistance
    flows = float(np.median(amperes[rests]))
    is_driven = abs(flows) > _FLOWS * abs(drives) and flows * drives > 0.0
    is_sure = abs(zero) > max(_SURE * noise / np.sqrt(len(volts)), _TELLING * voltage_rms(m.sensors))
    return zero if is_sure and not is_driven else 0.0
