"""Whether rows may miss commands: a current that answers a voltage before the row that shows it.

Rows are taken for voltages that are held until the next. Where a controller commands more often than its rows are
written, nobody knows what the motor got between two of them, and no model leaves what noise leaves.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.opening import without_diodes
from etb_hil.discrepancy.measured.rows import commanded, open_bridge
from etb_hil.plant.parameters import Model

Float64 = NDArray[np.float64]

_FAST = 900.0  # Hz; controllers of throttles command some 1000 times a second
_FEWEST = 100  # rows with a jump after them
_BEFORE = 0.04  # of what a voltage does in its own row, from where the next one has acted before its row
_SCATTERS = 0.015  # of the next jump's square: what no shift of the voltage in time accounts for


def may_miss_commands(measured: Measurement, model: Model) -> bool:
    """Tell whether commands may have changed between the rows of a measurement as it was recorded.

    At the end of a row a winding's current is linear in the current at its beginning, in the way and in the voltage:
    the next voltage has no part in it where one is held. One that is read late has the same part in every row, which
    leaves nothing to scatter. In slow rows without a current nothing tells.
    """
    if measured.is_drive:
        return False
    if measured.current is None:
        return measured.rate < _FAST
    m, current = without_diodes(measured, model), measured.current
    jump = np.diff(m.voltage)
    is_driven = m.is_good & ~open_bridge(m)
    rows = commanded(m) & is_driven[:-1] & is_driven[1:]
    if np.count_nonzero(rows) < _FEWEST:
        return False
    voltage, began = m.voltage[:-1], current[:-1]
    # What takes a voltage by the current between a command and the winding: brushes and dead time, a supply that sags;
    # and a current's sensor whose scale bends.
    taken = [np.sign(began), voltage * np.abs(began), voltage**2 * began, began**2]
    columns = np.column_stack([voltage, jump, began, np.diff(m.angle), *taken, np.ones(len(jump))])[rows]
    found, *_ = np.linalg.lstsq(columns, current[1:][rows], rcond=None)
    own, early = found[:2].tolist()
    scattered = float(np.mean((current[1:][rows] - columns @ found) ** 2))
    return early > _BEFORE * own and scattered > _SCATTERS * own**2 * float(np.mean(jump[rows] ** 2))
