"""Whether rows may miss commands: a current that does not follow from voltages that are held from row to row.

Where a controller commands more often than its rows are written, nobody knows what the motor got between two of them,
and no model leaves what noise leaves.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.rows import open_bridge
from etb_hil.plant.parameters import Model

Float64 = NDArray[np.float64]

_FAST = 900.0  # Hz; controllers of throttles command some 1000 times a second
_JUMPS = 10.0  # times the voltmeter's noise
_FEWEST = 100  # rows with a jump after them
_NOISY = 1.5  # times what the sensors' noise makes of the current: a row has seen more than its own voltage
_BEFORE = 0.04  # of what a voltage does in its own row, from where the next one has acted before its row
_SCATTERS = 0.02  # of the next jump's square: what no shift of the voltage in time accounts for


def may_miss_commands(measured: Measurement, model: Model) -> bool:
    """Tell whether commands may have changed between rows.

    At the end of a row a winding's current is linear in the current at its beginning, in the way and in the voltage:
    the next voltage has no part in it where one is held. One that is read late has the same part in every row, which
    leaves nothing to scatter. In slow rows, or without a current, what a fault leaves is not told from a command.
    """
    m = measured
    if m.is_drive:
        return False
    is_slow = m.rate < _FAST
    if m.current is None:
        return is_slow
    sensors, current = model.sensors, m.current
    step = 1.0 / np.sqrt(12.0)
    of_voltage = float(np.hypot(sensors.voltage_noise, sensors.voltage_step * step))
    of_current = float(np.hypot(sensors.current_noise, sensors.current_step * step))
    jump = np.diff(m.voltage)
    is_driven = m.is_good & ~open_bridge(m, model)
    rows = (np.abs(jump) > _JUMPS * of_voltage) & is_driven[:-1] & is_driven[1:]
    if np.count_nonzero(rows) < _FEWEST:
        return False
    columns = np.column_stack([m.voltage[:-1], jump, current[:-1], np.diff(m.angle), np.ones(len(jump))])[rows]
    found, *_ = np.linalg.lstsq(columns, current[1:][rows], rcond=None)
    own, early, stays, moves, _ = found.tolist()
    scattered = float(np.mean((current[1:][rows] - columns @ found) ** 2))
    if is_slow:
        noise = of_current**2 * (1.0 + stays**2) + of_voltage**2 * ((own - early) ** 2 + early**2)
        return bool(scattered > _NOISY**2 * (noise + 2.0 * (m.angle_noise * moves) ** 2))
    return bool(early > _BEFORE * own and scattered > _SCATTERS * own**2 * np.mean(jump[rows] ** 2))
