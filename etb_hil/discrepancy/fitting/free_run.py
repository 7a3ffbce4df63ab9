"""The model driven by the measured voltage alone, segment by segment."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.compiled import njit
from etb_hil.base.side_by_side import side_by_side
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.unknowns import simulable
from etb_hil.plant.effects import readings
from etb_hil.plant.effects.port import Port
from etb_hil.plant.extended import advance_extended, new_extended_state
from etb_hil.plant.integrator import CURRENT, OMEGA, THETA, TICK
from etb_hil.plant.physics import Vector
from etb_hil.recording.samples import Float64
from etb_hil.results.explained.errors import Gain

POSITION, CURRENT_ROLE = "throttle_angle", "motor_current"
SEGMENT_S = 2.0
STEP_S = 0.01  # of the one-step error
_DRAWS = 2000  # of the bootstrap of a gain
_LEAD_S = 2.5e-4  # of a step along the measured motion, about: shorter ones do not change the error of a free run
# Steps of a free run, about, where they change so little: a reading by a tenth of the rms error, whose square is one
# percent of the error's, and the error itself by one percent (decision 0033).
_STEPS_S = (2.5e-4, 1.25e-4)
_CHANGE, _GROWTH = 0.1, 0.01


def starts(b: Balances, p: Vector) -> Float64:
    """Return the model's state (segments, states) at the start of each segment.

    The state is led there along the measured motion: bristles and temperatures at the start of a segment come from what
    happened before.
    """
    samples = round(SEGMENT_S * b.measured.rate)
    return _led(b, p, np.arange(0, len(b.measured) - samples + 1, samples))


def errors(
    b: Balances, parameters: Callable[[float], Vector], begin_at: Float64, ticks: int, *, one_step: bool
) -> dict[str, Float64]:
    """Return rms errors (SI) by segment of each signal, each segment started anew.

    `parameters` gives the extended vector for a segment that begins at a share (0 to 1) of the record, `begin_at` the
    states (segments, states) that it starts from, `ticks` the steps a sample. With `one_step` angle, velocity and
    current are reset to the measured ones every 10 ms.
    """
    m = b.measured
    samples = round(SEGMENT_S * m.rate)
    has_current = m.current is not None and m.device.has_winding
    found: dict[str, list[float]] = {name: [] for name in ((POSITION, CURRENT_ROLE) if has_current else (POSITION,))}
    every = _resets(b) if one_step else 0
    begins = range(0, len(m) - samples + 1, samples)

    def run(number: int) -> tuple[Float64, Float64]:
        begin = begins[number]
        return segment(b, parameters(begin / len(m)), begin, begin_at[number], samples, ticks, every)

    for begin, (angle, current) in zip(begins, side_by_side(run, range(len(begins))), strict=True):
        part = slice(begin, begin + samples)
        found[POSITION].append(rms(angle - m.angle[part]))
        if has_current and m.current is not None:
            found[CURRENT_ROLE].append(rms(current - m.current[part]))
    return {name: np.array(values) for name, values in found.items()}


def fewest_ticks(b: Balances, p: Vector) -> int:
    """Return into how few steps a sample may be cut for free runs of a model.

    Longer steps are taken where they change an angle and a current over 10 ms by little of what those of the model are
    off by. With an elastic shaft they change much, with most models nothing.
    """
    m, samples, most = b.measured, round(SEGMENT_S * b.measured.rate), ticks_of(b.measured.dt)
    begins = range(0, len(m) - samples + 1, samples)
    fewer = [ticks for ticks in (max(1, round(m.dt / step)) for step in _STEPS_S) if ticks < most]
    if not begins or not fewer:
        return most
    numbers, states, judged = range(len(begins)), starts(b, p), slice(len(begins) * samples)
    current = m.current if m.device.has_winding else None
    measured = [signal[judged] for signal in (m.angle, current) if signal is not None]

    def off(ticks: int) -> list[Float64]:
        parts = [*side_by_side(lambda k: segment(b, p, begins[k], states[k], samples, ticks, _resets(b)), numbers)]
        return [np.concatenate([part[k] for part in parts]) - signal for k, signal in enumerate(measured)]

    def is_same(coarse: Float64, fine: Float64) -> bool:
        error = rms(fine)
        return rms(coarse - fine) <= _CHANGE * error and abs(rms(coarse) - error) <= _GROWTH * error

    by_most = off(most)
    return next((ticks for ticks in fewer if all(map(is_same, off(ticks), by_most))), most)


def _resets(b: Balances) -> int:
    return max(1, round(STEP_S * b.measured.rate))


def segment(
    b: Balances, p: Vector, begin: int, begin_at: Vector, samples: int, ticks: int, every: int = 0
) -> tuple[Float64, Float64]:
    """Return angle and current (samples) as sensors read them, from a state on.

    `ticks`: steps a sample; `every`: samples between two resets to the measured motion, 0 for none.
    """
    m = b.measured
    p = simulable(p)
    angle, velocity = b.motion(p)
    part = slice(begin, begin + samples)
    out = np.empty((samples, 2))
    _run(
        begin_at.copy(), p, b.free_voltage[part], m.temperature[part], angle[part], velocity[part],
        b.current(p)[part], m.dt, ticks, every, out,
    )  # fmt: skip
    current = readings.arrived(out[:, 1], m.dt, Port.CURRENT_LATENESS, p)
    angle = readings.arrived(out[:, 0], m.dt, m.lateness_of_angle, p)
    sensed = readings.measured_current(current, m.temperature[part], p)
    return readings.measured_angle(angle * b.gear, p) / b.gear, sensed


def trace(b: Balances, p: Vector, begin: int, samples: int | None = None) -> Float64:
    """Return the encoder's angle (samples, else a segment's), run freely."""
    begin_at, rate = _led(b, p, np.array([begin]))[0], b.measured.rate
    return segment(b, p, begin, begin_at, samples or round(SEGMENT_S * rate), ticks_of(b.measured.dt))[0]


def _led(b: Balances, p: Vector, begins: NDArray[np.int64]) -> Float64:
    """Return the state (begins, states) at some samples after following the motion."""
    m = b.measured
    p = simulable(p)
    angle, velocity = b.motion(p)
    state = new_extended_state(float(angle[0]), float(m.temperature[0]), p)
    found = np.empty((len(begins), len(state)))
    _lead(
        state, p, b.free_voltage, m.temperature, angle, velocity, b.current(p), m.dt, max(1, round(m.dt / _LEAD_S)),
        begins, found,
    )  # fmt: skip
    return found


def ticks_of(dt: float) -> int:
    """Return in how many ticks a sampling period in s is simulated.

    Each lasts about as long as the plant's own.
    """
    return max(1, round(dt / TICK))


def rms(values: Float64) -> float:
    """Return the root of the mean square of values."""
    return float(np.sqrt(np.mean(values**2)))


@njit(cache=True, error_model="numpy")
def _set(state: Vector, angle: float, velocity: float, current: float) -> None:
    state[THETA], state[OMEGA] = angle, velocity
    if not np.isnan(current):
        state[CURRENT] = current


@njit(cache=True, error_model="numpy", nogil=True)
def _lead(
    state: Vector,
    p: Vector,
    voltage: Vector,
    temperature: Vector,
    angle: Vector,
    velocity: Vector,
    current: Vector,
    dt: float,
    ticks: int,
    begins: NDArray[np.int64],
    found: Float64,
) -> None:
    k = 0
    for number in range(begins.size):
        while k < begins[number]:
            _set(state, angle[k], velocity[k], current[k])
            advance_extended(state, p, voltage[k], ticks, temperature[k], dt / ticks)
            k += 1
        _set(state, angle[k], velocity[k], current[k])
        found[number] = state


@njit(cache=True, error_model="numpy", nogil=True)
def _run(
    state: Vector,
    p: Vector,
    voltage: Vector,
    temperature: Vector,
    angle: Vector,
    velocity: Vector,
    current: Vector,
    dt: float,
    ticks: int,
    every: int,
    out: Float64,
) -> None:
    for k in range(voltage.size):
        if every > 0 and k % every == 0 and k > 0:
            _set(state, angle[k], velocity[k], current[k])
        out[k, 0] = state[THETA]
        out[k, 1] = state[CURRENT]
        # With the bridge off the voltmeter sees the motor: driven by it, no current flows, which is what happens.
        advance_extended(state, p, voltage[k], ticks, temperature[k], dt / ticks)


def gain_of(before: Float64, after: Float64) -> Gain:
    """Return by what share rms errors (parts) of one model are less than another's.

    The interval is a bootstrap over the parts.
    """
    rng = np.random.default_rng(0)
    picks = rng.integers(len(before), size=(_DRAWS, len(before)))
    drawn = 1.0 - np.sqrt((after[picks] ** 2).sum(1) / np.maximum((before[picks] ** 2).sum(1), 1e-30))
    value = 1.0 - float(np.sqrt(np.sum(after**2) / max(float(np.sum(before**2)), 1e-30)))
    low, high = np.percentile(drawn, [2.5, 97.5])
    return Gain(value, (float(low), float(high)))
