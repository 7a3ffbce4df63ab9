"""The current sensor's zero as fitted against the zero seen at rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.candidates.refinement import Linearised
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.data_sheet import current_rms
from etb_hil.discrepancy.measured.repair.rest_blocks import Blocks
from etb_hil.plant.effects import readings
from etb_hil.plant.effects.port import Port
from etb_hil.plant.physics import RESISTANCE

# Decision 0030. Units with nothing hidden by these thresholds: benchmarks/explain_study.py, kind `nothing`.
_NO_VOLTAGE = 0.1  # of what would drive that current
_ENOUGH = 5  # blocks: a quarter of a second
_SURE = 6.0  # times its standard error
_TELLING = 0.1  # of the current sensor's noise; less is nothing to any balance
_OTHERWISE = 0.5  # of the zero that a fit has


def is_refuted(balances: Sequence[Balances], fitted: Linearised) -> bool:
    """Tell whether a fitted zero of the current contradicts the zero seen at rest."""
    effect = fitted.candidate.effect
    if effect is None or not effect.acts_at(Port.CURRENT_ZERO):
        return False
    return any(_reads_otherwise(b, fitted) for b in balances)


def _reads_otherwise(b: Balances, fitted: Linearised) -> bool:
    m = b.measured
    if m.current is None or m.is_drive:
        return False
    whole = fitted.fit.whole
    blocks = Blocks.of(m)
    zero = readings.current_zero(np.zeros(len(m)), m.temperature, whole)
    volts, said, seen = (blocks.cut(values).mean(axis=1) for values in (m.voltage, zero, m.current))
    # A motor that rests without a voltage has no current, whether its bridge is off or commands nothing.
    rests = blocks.rests & (np.abs(volts) < _NO_VOLTAGE * whole[RESISTANCE] * np.abs(said))
    if np.count_nonzero(rests) < _ENOUGH:
        return False
    said, seen = said[rests], seen[rests]
    off = float(np.median(seen - said))
    spread = float(np.median(np.abs(seen - said - off)))
    noise = max(current_rms(m.sensors) / np.sqrt(blocks.samples), spread)
    sure = max(_SURE * noise / np.sqrt(len(seen)), _TELLING * current_rms(m.sensors))
    return abs(off) > max(sure, _OTHERWISE * abs(float(np.median(said))))
