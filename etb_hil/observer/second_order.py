"""Second-order sliding mode from the angle alone (Davila, Fridman and Levant 2005)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from etb_hil.observer.differentiator import differentiate
from etb_hil.observer.estimate import Estimate
from etb_hil.observer.kalman import LONGEST_GAP_NS
from etb_hil.observer.sliding_mode import SlidingModeSettings
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.plant.physics import INERTIA, TORQUE_PER_AMPERE, spring_torque
from etb_hil.recording.samples import Float64, Int64

_LATE = 1.5  # times the step before: a sample that comes later than this has lost one before it
_SETTLING = 15.0  # time constants of the filter: at the start all of the velocity passes for a torque

_LAG, _BOUND = 0, 1
_ANGLE, _VELOCITY, _FIRST, _FILTERED, _AGE, _CURRENT, _STEP, _RUNNING = range(8)
_STATES = 8


class SecondOrderSlidingModeObserver:
    """Observes angle and velocity; friction is what the switching adds to the known acceleration, low-pass filtered.

    `switching_torque` of the settings bounds the friction. Discretised implicitly: no chattering about an exact signal.
    The friction lags by twice the filter's time constant; noise of the angle passes as J / step^2, up to the bound.
    """

    def __init__(self, throttle: ThrottleParameters, settings: SlidingModeSettings | None = None) -> None:
        chosen = settings or SlidingModeSettings()
        switching = 4.0 * throttle.stiction if chosen.switching_torque is None else chosen.switching_torque
        lag = 1.0 / (2.0 * math.pi * chosen.cutoff)
        self._p = throttle.vector()
        self._tuning = np.array([lag, switching / throttle.inertia])
        self._state = np.zeros(_STATES)
        self._last_ns = np.zeros(1, np.int64)
        self._delay_ns = round(2e9 * lag)

    def push(self, time_ns: Int64, current: Float64, angle: Float64) -> Estimate:
        """Take samples and return velocity and friction torque at their instants; see `Observer.push`."""
        velocity, friction = np.empty(len(time_ns)), np.empty(len(time_ns))
        state = (self._p, self._tuning, self._state, self._last_ns)
        _observe(time_ns, current, angle, *state, velocity, friction)
        return Estimate(time_ns, velocity, friction, np.full(len(time_ns), self._delay_ns))


@njit(cache=True, error_model="numpy")
def _observe(
    time_ns: Int64,
    current: Float64,
    angle: Float64,
    p: Float64,
    tuning: Float64,
    s: Float64,
    last_ns: Int64,
    velocity: Float64,
    friction: Float64,
) -> None:
    inertia = p[INERTIA]
    for k in range(len(time_ns)):
        i, measured = current[k], angle[k]
        velocity[k] = friction[k] = np.nan
        if math.isnan(i) or math.isnan(measured):
            continue
        step_ns = time_ns[k] - last_ns[0]
        last_ns[0] = time_ns[k]
        if s[_RUNNING] == 0.0 or step_ns > LONGEST_GAP_NS or step_ns <= 0:
            s[:] = 0.0
            s[_ANGLE], s[_CURRENT], s[_RUNNING] = measured, i, 1.0
            continue
        dt = step_ns * 1e-9
        known = (p[TORQUE_PER_AMPERE] * 0.5 * (i + s[_CURRENT]) - spring_torque(s[_ANGLE], p)) / inertia
        free = s[_VELOCITY] + dt * known
        s[_ANGLE], s[_VELOCITY] = differentiate(s[_ANGLE], free, measured, dt, tuning[_BOUND])
        if dt <= _LATE * s[_STEP] or s[_STEP] == 0.0:
            share = dt / (tuning[_LAG] + dt)
            s[_FIRST] += share * ((free - s[_VELOCITY]) * inertia / dt - s[_FIRST])
            s[_FILTERED] += share * (s[_FIRST] - s[_FILTERED])
        s[_AGE] += dt
        s[_CURRENT], s[_STEP] = i, dt
        if s[_AGE] >= _SETTLING * tuning[_LAG]:
            velocity[k] = s[_VELOCITY]
            friction[k] = s[_FILTERED]
