"""Second-order sliding mode from the angle alone (Davila, Fridman and Levant 2005)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from etb_hil.observer.differentiator import differentiate, reaches
from etb_hil.observer.estimate import Estimate
from etb_hil.observer.kalman import LONGEST_GAP_NS
from etb_hil.observer.sliding_mode import SlidingModeSettings
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.plant.physics import INERTIA, TORQUE_PER_AMPERE, registers, spring_torque
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
    bound, lag, torque_per_ampere, inertia = tuning[_BOUND], tuning[_LAG], p[TORQUE_PER_AMPERE], p[INERTIA]
    per_inertia, settled, values = 1.0 / inertia, _SETTLING * lag, registers(p)
    counted = per_dt = share = near = slope = 0.0
    # What every sample needs stays out of memory: as elements of `s`, they would be stored and loaded sample by sample.
    theta, omega, first, filtered = s[_ANGLE], s[_VELOCITY], s[_FIRST], s[_FILTERED]
    age, before, step, runs, last = s[_AGE], s[_CURRENT], s[_STEP], s[_RUNNING], last_ns[0]
    for k in range(len(time_ns)):
        i, measured = current[k], angle[k]
        velocity[k] = friction[k] = np.nan
        if math.isnan(i) or math.isnan(measured):
            continue
        step_ns = time_ns[k] - last
        last = time_ns[k]
        if runs == 0.0 or step_ns > LONGEST_GAP_NS or step_ns <= 0:
            omega = first = filtered = age = step = 0.0
            theta, before, runs = measured, i, 1.0
            continue
        dt = step_ns * 1e-9
        if dt != counted:  # divisions are dear, and the step hardly ever changes
            counted, per_dt = dt, 1.0 / dt
            share = dt / (lag + dt)
            near, slope = reaches(dt, bound)
        free = omega + dt * per_inertia * (torque_per_ampere * 0.5 * (i + before) - spring_torque(theta, values))
        theta, omega = differentiate(theta, free, measured, dt, per_dt, near, slope)
        if dt <= _LATE * step or step == 0.0:
            first += share * ((free - omega) * inertia * per_dt - first)
            filtered += share * (first - filtered)
        age += dt
        before, step = i, dt
        if age >= settled:
            velocity[k] = omega
            friction[k] = filtered
    s[_ANGLE], s[_VELOCITY], s[_FIRST], s[_FILTERED] = theta, omega, first, filtered
    s[_AGE], s[_CURRENT], s[_STEP], s[_RUNNING], last_ns[0] = age, before, step, runs, last
