"""The model run by the measured voltage alone, segment by segment, against what was measured."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.unknowns import simulable
from etb_hil.plant.effects import (
    angle_sensor_eccentricity,
    current_sensor_gain,
    current_sensor_offset,
)
from etb_hil.plant.extended import PLATE, advance_extended, new_extended_state
from etb_hil.plant.integrator import BRISTLE, CURRENT, OMEGA, THETA, TICK
from etb_hil.plant.physics import BRISTLE_STIFFNESS, COULOMB, TORQUE_PER_AMPERE, Vector, spring_torque

Float64 = NDArray[np.float64]

POSITION, CURRENT_ROLE = "throttle_angle", "motor_current"
SEGMENT_S = 2.0
STEP_S = 0.01  # of the one-step error
_REST_BAND = 0.02  # rad/s


def errors(b: Balances, parameters: Callable[[float], Vector], *, one_step: bool) -> dict[str, Float64]:
    """Return root mean square errors by segment of each signal in SI, the model started anew at each segment.

    `parameters` gives the extended vector for a segment that begins at a share (0 to 1) of the record. With `one_step`
    angle, velocity and current are set to the measured ones every 10 ms.
    """
    m = b.measured
    rows = round(SEGMENT_S * m.rate)
    has_current = m.current is not None and not m.is_drive
    found: dict[str, list[float]] = {name: [] for name in ((POSITION, CURRENT_ROLE) if has_current else (POSITION,))}
    for begin in range(0, len(m) - rows + 1, rows):
        every = max(1, round(STEP_S * m.rate)) if one_step else 0
        angle, current = _segment(b, parameters(begin / len(m)), begin, rows, every)
        part = slice(begin, begin + rows)
        found[POSITION].append(_rms(angle - m.angle[part]))
        if has_current and m.current is not None:
            found[CURRENT_ROLE].append(_rms(current - m.current[part]))
    return {name: np.array(values) for name, values in found.items()}


def _segment(b: Balances, p: Vector, begin: int, rows: int, every: int) -> tuple[Float64, Float64]:
    """Return angle and current (rows) as the sensors tell them; `every`: rows between two fresh starts, 0 none."""
    m = b.measured
    p = simulable(p)
    angle, velocity = b.motion(p)
    part = slice(begin, begin + rows)
    current = np.zeros(rows) if m.current is None else _true_current(b, p)[part]
    state = new_extended_state(float(angle[begin]), float(m.temperature[begin]))
    state[OMEGA], state[CURRENT] = velocity[begin], current[0]
    state[BRISTLE] = _bristle(p, float(angle[begin]), float(velocity[begin]), float(current[0]))
    out = np.empty((rows, 3))
    _run(
        state, p, b.driving[part], m.temperature[part], angle[part], velocity[part], current,
        round(m.dt / TICK), every, out,
    )  # fmt: skip
    sensed = current_sensor_gain.measured_current(out[:, 1], p)
    sensed = current_sensor_offset.measured_current(sensed, m.temperature[part], p)
    return angle_sensor_eccentricity.measured_angle(out[:, 0] * b.gear, p) / b.gear, sensed


def trace(b: Balances, p: Vector, begin: int, rows: int | None = None) -> Float64:
    """Return the model's angle (rows; else a segment's) as the encoder would tell it, run freely from a row on."""
    return _segment(b, p, begin, rows or round(SEGMENT_S * b.measured.rate), 0)[0]


def _true_current(b: Balances, p: Vector) -> Float64:
    m = b.measured
    assert m.current is not None  # noqa: S101 (asked only where it was measured)
    current = current_sensor_offset.true_current(m.current, m.temperature, p)
    return current_sensor_gain.true_current(current, p)


def _bristle(p: Vector, angle: float, velocity: float, current: float) -> float:
    """Return the bristles' deflection in rad that fits the start: what holds the plate at rest, else sliding."""
    most = p[COULOMB] / p[BRISTLE_STIFFNESS]
    if abs(velocity) > _REST_BAND:
        return float(np.sign(velocity) * most)
    balance = (p[TORQUE_PER_AMPERE] * current - spring_torque(angle, p)) / p[BRISTLE_STIFFNESS]
    return float(np.clip(balance, -most, most))


def _rms(values: Float64) -> float:
    return float(np.sqrt(np.mean(values**2)))


@njit(cache=True, error_model="numpy")
def _run(
    state: Vector,
    p: Vector,
    voltage: Vector,
    temperature: Vector,
    angle: Vector,
    velocity: Vector,
    current: Vector,
    ticks: int,
    every: int,
    out: Float64,
) -> None:
    for k in range(voltage.size):
        if every > 0 and k % every == 0 and k > 0:
            state[THETA], state[OMEGA], state[CURRENT] = angle[k], velocity[k], current[k]
        out[k, 0] = state[THETA]
        out[k, 1] = state[CURRENT]
        out[k, 2] = state[PLATE]
        u = voltage[k]
        # With the bridge off the voltmeter sees the motor: driven by it, no current flows, which is what happens.
        advance_extended(state, p, u, ticks, temperature[k])
