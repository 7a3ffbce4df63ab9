"""A bench with all that goes wrong on one: noisy sensors, spikes, a zero, a row too late, a host's stamps."""

from dataclasses import replace

import numpy as np

_NOISIER = 2.0  # times the data sheet
_SPIKES = 10
_SPIKE = 5.0  # A
_ZERO = 0.02  # V
_LATE = 1e-4  # s, in the mean


def rough(sensors):
    """The sensors as they are, behind a data sheet that says less."""
    noise = {name: _NOISIER * getattr(sensors, name) for name in ("current_noise", "voltage_noise", "plate_noise")}
    return replace(sensors, **noise)


def as_logged(table, seed):
    """A table as such a bench writes it."""
    rng = np.random.default_rng(seed)
    count = len(table["time"])
    current = table["motor_current"].copy()
    current[rng.integers(100, count - 100, _SPIKES)] += _SPIKE
    return {
        **table,
        "time": np.maximum.accumulate(table["time"] + rng.exponential(_LATE, count)),
        "motor_voltage": np.roll(table["motor_voltage"] + _ZERO, 1),
        "motor_current": current,
    }
