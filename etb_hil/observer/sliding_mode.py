"""The seed paper's observer: first-order sliding mode, its equivalent control read through a low-pass filter."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from etb_hil.observer.angle import LONGEST_GAP_NS
from etb_hil.observer.differentiator import differentiate
from etb_hil.observer.estimate import Estimate
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.plant.physics import INERTIA, TORQUE_PER_AMPERE, spring_torque
from etb_hil.recording.samples import Float64, Int64

_LATE = 1.5  # times the step before: a sample that comes later than this has lost one before it
_SETTLING = 5.0  # time constants of the filter until what it says is the present and not its start

_ANGLE, _VELOCITY, _OBSERVED, _FIRST, _FILTERED, _AGE, _CURRENT, _STEP, _RUNNING = range(9)
_STATES = 9


@dataclass(frozen=True, slots=True)
class SlidingModeSettings:
    """The two choices that the paper leaves open.

    `switching_torque`, M in N·m, above the largest friction torque and disturbance; None takes four times the model's
    stiction, so that a unit far beyond its limit is still followed. `cutoff`, of the low-pass filter, in Hz: lower
    leaves less ripple and underestimates T_st more.
    """

    switching_torque: float | None = None
    cutoff: float = 60.0


class SlidingModeObserver:
    """Seed paper, eq. (4) to (6), with a second-order low-pass filter on M sgn.

    The velocity is a measured one where it is given, as in the paper; else a robust differentiator takes it from the
    angle.
    """

    def __init__(self, throttle: ThrottleParameters, settings: SlidingModeSettings | None = None) -> None:
        chosen = settings or SlidingModeSettings()
        switching = 4.0 * throttle.stiction if chosen.switching_torque is None else chosen.switching_torque
        strongest = throttle.torque_per_ampere * throttle.voltage_limit / throttle.resistance
        self._p = throttle.vector()
        self._tuning = np.array([switching, 1.0 / (2.0 * math.pi * chosen.cutoff), strongest / throttle.inertia])
        self._state = np.zeros(_STATES)
        self._last_ns = np.zeros(1, np.int64)
        self._delay_ns = round(2e9 * float(self._tuning[1]))

    def push(
        self, time_ns: Int64, current: Float64, angle: Float64, measured_velocity: Float64 | None = None
    ) -> Estimate:
        """Take samples, with the velocity (n) in rad/s where one is measured; see `Observer.push`."""
        velocity, friction = np.empty(len(time_ns)), np.empty(len(time_ns))
        given = np.empty(0) if measured_velocity is None else measured_velocity
        _observe(time_ns, current, angle, given, self._p, self._tuning, self._state, self._last_ns, velocity, friction)
        return Estimate(time_ns, velocity, friction, np.full(len(time_ns), self._delay_ns))


@njit(cache=True, error_model="numpy", inline="always")
def _slide(i: float, measured: float, dt: float, p: Float64, tuning: Float64, s: Float64) -> None:
    """Move eq. (4) and the filter on M sgn by one step."""
    switching, lag = tuning[0], tuning[1]
    error = s[_OBSERVED] - s[_VELOCITY]
    equivalent = switching if error > 0.0 else -switching if error < 0.0 else 0.0
    known = p[TORQUE_PER_AMPERE] * 0.5 * (i + s[_CURRENT]) - spring_torque(measured, p)
    s[_OBSERVED] += dt * (known - equivalent) / p[INERTIA]
    # Backward Euler: stable for any step, and no exponential.
    share = dt / (lag + dt)
    s[_FIRST] += share * (equivalent - s[_FIRST])
    s[_FILTERED] += share * (s[_FIRST] - s[_FILTERED])


@njit(cache=True, error_model="numpy")
def _observe(
    time_ns: Int64,
    current: Float64,
    angle: Float64,
    given: Float64,
    p: Float64,
    tuning: Float64,
    s: Float64,
    last_ns: Int64,
    velocity: Float64,
    friction: Float64,
) -> None:
    lag, bound = tuning[1], tuning[2]
    is_given = len(given) > 0
    for k in range(len(time_ns)):
        i, measured = current[k], angle[k]
        velocity[k] = friction[k] = np.nan
        if math.isnan(i) or math.isnan(measured) or (is_given and math.isnan(given[k])):
            continue
        step_ns = time_ns[k] - last_ns[0]
        last_ns[0] = time_ns[k]
        if s[_RUNNING] == 0.0 or step_ns > LONGEST_GAP_NS or step_ns <= 0:
            start = given[k] if is_given else 0.0
            s[_ANGLE], s[_VELOCITY], s[_OBSERVED] = measured, start, start
            s[_FIRST] = s[_FILTERED] = s[_AGE] = s[_STEP] = 0.0
            s[_CURRENT], s[_RUNNING] = i, 1.0
            continue
        dt = step_ns * 1e-9
        error = s[_OBSERVED] - s[_VELOCITY]
        if is_given:
            s[_VELOCITY] = given[k]
        else:
            s[_ANGLE], s[_VELOCITY] = differentiate(s[_ANGLE], s[_VELOCITY], measured, dt, bound)
        if dt > _LATE * s[_STEP] and s[_STEP] > 0.0:
            # A sign held over the gap would pass for a torque: the filter waits, and sliding goes on where it was.
            s[_OBSERVED] = s[_VELOCITY] + error
        else:
            _slide(i, measured, dt, p, tuning, s)
        s[_AGE] += dt
        s[_CURRENT], s[_STEP] = i, dt
        if s[_AGE] >= _SETTLING * 2.0 * lag:
            velocity[k] = s[_VELOCITY]
            friction[k] = s[_FILTERED]
