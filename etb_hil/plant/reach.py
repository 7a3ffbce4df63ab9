"""Which velocities a throttle can reach between its stops."""

from __future__ import annotations

import numpy as np

from etb_hil.plant.integrator import OMEGA, STATES, THETA, advance_record, new_state
from etb_hil.plant.physics import Vector
from etb_hil.plant.values import ThrottleParameters

_TICKS = 8000  # 0.4 s: no throttle that moves at all takes longer from stop to stop


def peak_velocities(values: ThrottleParameters) -> tuple[float, float]:
    """Return the top speeds in rad/s, opening and closing.

    Full voltage reaches them, and full braking still stops.
    """
    return (
        _peak(values, values.stop_low, values.stop_high, values.voltage_limit),
        _peak(values, values.stop_high, values.stop_low, -values.voltage_limit),
    )


def _peak(values: ThrottleParameters, start: float, goal: float, voltage: float) -> float:
    p = values.vector()
    rush = _run(new_state(start), p, voltage)

    def stops_in_time(tick: int) -> bool:
        brake = _run(rush[tick].copy(), p, -voltage)
        turned = np.flatnonzero(brake[:, OMEGA] * voltage <= 0.0)
        return bool(len(turned)) and (goal - float(brake[turned[0], THETA])) * voltage > 0.0

    arrived = np.flatnonzero((rush[:, THETA] - goal) * voltage >= 0.0)
    low, high = 0, int(arrived[0]) if len(arrived) else _TICKS - 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if stops_in_time(middle) else (low, middle)
    return float(np.max(np.abs(rush[: low + 1, OMEGA])))


def _run(state: Vector, p: Vector, voltage: float) -> Vector:
    record = np.empty((_TICKS, STATES))
    advance_record(state, p, np.array([voltage]), _TICKS, record)
    return record
