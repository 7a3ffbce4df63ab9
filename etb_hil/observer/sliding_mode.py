"""Sliding-mode observers of the velocity equation: the seed paper's, and two that chatter less.

All three observe eq. (3) of the seed paper from current and velocity, and read friction off what holds the observed
velocity to the measured one. The velocity is a measured one where it is given, as in the paper; else a robust
differentiator takes it from the angle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from etb_hil.observer.differentiator import differentiate, reaches
from etb_hil.observer.estimate import Estimate
from etb_hil.observer.kalman import LONGEST_GAP_NS
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.plant.physics import INERTIA, TORQUE_PER_AMPERE, registers, spring_torque
from etb_hil.recording.samples import Float64, Int64

_LATE = 1.5  # times the step before: a sample that comes later than this has lost one before it
_SETTLING = 15.0  # time constants of the filter: at the start all of the velocity passes for a torque
_REVERSAL_S = 0.01  # the shortest time in which friction turns round: what the bound of its rate is made of

_EXPLICIT, _IMPLICIT, _SUPER_TWISTING = range(3)
_LAG, _BOUND, _SWITCHING, _RATE = range(4)
_ANGLE, _VELOCITY, _OBSERVED, _FIRST, _FILTERED, _AGE, _CURRENT, _STEP, _RUNNING, _INTEGRAL = range(10)
_STATES = 10


@dataclass(frozen=True, slots=True)
class SlidingModeSettings:
    """The two choices that the paper leaves open.

    `switching_torque`, M in N·m, above the largest friction torque and disturbance; None takes four times the model's
    stiction, so that a unit far beyond its limit is still followed. `cutoff`, of the low-pass filter, in Hz: lower
    leaves less ripple and underestimates T_st more.
    """

    switching_torque: float | None = None
    cutoff: float = 60.0


class _VelocityObserver:
    """What the three have in common: all but the law that drives the observed velocity to the measured one."""

    _law: int

    def __init__(self, throttle: ThrottleParameters, settings: SlidingModeSettings | None = None) -> None:
        chosen = settings or SlidingModeSettings()
        switching = 4.0 * throttle.stiction if chosen.switching_torque is None else chosen.switching_torque
        strongest = throttle.torque_per_ampere * throttle.voltage_limit / throttle.resistance
        lag = 1.0 / (2.0 * math.pi * chosen.cutoff)
        rate = 2.0 * throttle.stiction / throttle.inertia / _REVERSAL_S
        self._p = throttle.vector()
        self._tuning = np.array([lag, strongest / throttle.inertia, switching, rate])
        self._state = np.zeros(_STATES)
        self._last_ns = np.zeros(1, np.int64)
        self._delay_ns = round(2e9 * lag)

    def push(
        self, time_ns: Int64, current: Float64, angle: Float64, measured_velocity: Float64 | None = None
    ) -> Estimate:
        """Take samples, with the velocity (n) in rad/s where one is measured; see `Observer.push`."""
        velocity, friction = np.empty(len(time_ns)), np.empty(len(time_ns))
        given = np.empty(0) if measured_velocity is None else measured_velocity
        state = (self._p, self._tuning, self._state, self._last_ns)
        _observe(time_ns, current, angle, given, *state, self._law, velocity, friction)
        return Estimate(time_ns, velocity, friction, np.full(len(time_ns), self._delay_ns))


class SlidingModeObserver(_VelocityObserver):
    """Seed paper, eq. (4) to (6): M sgn through a second-order low-pass filter.

    The friction lags by twice the filter's time constant. Without any noise, M sgn leaves a ripple that falls with the
    step; noise of the velocity passes into the sign and is weighed by M, whatever its size.
    """

    _law = _EXPLICIT


class ImplicitSlidingModeObserver(_VelocityObserver):
    """The same with the sign taken at the end of the step (Acary and Brogliato 2010): a projection, no chattering.

    The friction lags by twice the filter's time constant; noise of the velocity passes as J / step, up to M.
    """

    _law = _IMPLICIT


class SuperTwistingObserver(_VelocityObserver):
    """Super-twisting (Levant 1993): the switching is integrated, so that the friction torque comes out continuous.

    The bound of its rate is a reversal of the model's stiction in 10 ms. Filter and lag are those of the others.
    """

    _law = _SUPER_TWISTING


@njit(cache=True, error_model="numpy", inline="always")
def _hold(
    law: int,
    observed: float,
    integral: float,
    error: float,
    velocity: float,
    known: float,
    dt: float,
    per_dt: float,
    inertia: float,
    per_inertia: float,
    switching: float,
    near: float,
    slope: float,
) -> tuple[float, float, float]:
    """Move the observed velocity by one step; return it, the integral, and the torque that held it where it was.

    `error` is how far it was off at the step's beginning, `velocity` the true one at its end; `near` and `slope` are
    the differentiator's, which is super-twisting itself.
    """
    free = observed + dt * known * per_inertia
    if law == _SUPER_TWISTING:
        held, integral = differentiate(free, integral, velocity, dt, per_dt, near, slope)
        # All that was injected: noise makes the proportional part lean to one side, and the integral makes up for it.
        return held, integral, (free - held) * inertia * per_dt
    if law == _IMPLICIT:
        torque = min(max((free - velocity) * inertia * per_dt, -switching), switching)
    else:
        torque = switching if error > 0.0 else -switching if error < 0.0 else 0.0
    return free - dt * torque * per_inertia, integral, torque


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
    law: int,
    velocity: Float64,
    friction: Float64,
) -> None:
    is_given = len(given) > 0
    lag, bound, torque_per_ampere, inertia = tuning[_LAG], tuning[_BOUND], p[TORQUE_PER_AMPERE], p[INERTIA]
    settled, per_inertia, switching, rate = _SETTLING * lag, 1.0 / inertia, tuning[_SWITCHING], tuning[_RATE]
    counted = per_dt = share = near = slope = near_held = slope_held = 0.0
    # What every sample needs stays out of memory: as elements of `s`, they would be stored and loaded sample by sample.
    theta, omega, observed, integral = s[_ANGLE], s[_VELOCITY], s[_OBSERVED], s[_INTEGRAL]
    first, filtered, age, before, step = s[_FIRST], s[_FILTERED], s[_AGE], s[_CURRENT], s[_STEP]
    runs, last, values = s[_RUNNING], last_ns[0], registers(p)
    for k in range(len(time_ns)):
        i, measured = current[k], angle[k]
        velocity[k] = friction[k] = np.nan
        if math.isnan(i) or math.isnan(measured) or (is_given and math.isnan(given[k])):
            continue
        step_ns = time_ns[k] - last
        last = time_ns[k]
        if runs == 0.0 or step_ns > LONGEST_GAP_NS or step_ns <= 0:
            observed = omega = given[k] if is_given else 0.0
            integral = first = filtered = age = step = 0.0
            theta, before, runs = measured, i, 1.0
            continue
        dt = step_ns * 1e-9
        if dt != counted:  # divisions are dear, and the step hardly ever changes
            counted, per_dt = dt, 1.0 / dt
            share = dt / (lag + dt)  # backward Euler: stable for any step, and no exponential
            near, slope = reaches(dt, bound)
            near_held, slope_held = reaches(dt, rate)
        error = observed - omega
        if is_given:
            omega = given[k]
        else:
            theta, omega = differentiate(theta, omega, measured, dt, per_dt, near, slope)
        if dt > _LATE * step and step > 0.0:
            # A sign held over the gap would pass for a torque: the filter waits, and sliding goes on where it was.
            observed = omega + error
        else:
            known = torque_per_ampere * 0.5 * (i + before) - spring_torque(measured, values)
            observed, integral, torque = _hold(
                law,
                observed,
                integral,
                error,
                omega,
                known,
                dt,
                per_dt,
                inertia,
                per_inertia,
                switching,
                near_held,
                slope_held,
            )
            first += share * (torque - first)
            filtered += share * (first - filtered)
        age += dt
        before, step = i, dt
        if age >= settled:
            velocity[k] = omega
            friction[k] = filtered
    s[_ANGLE], s[_VELOCITY], s[_OBSERVED], s[_INTEGRAL] = theta, omega, observed, integral
    s[_FIRST], s[_FILTERED], s[_AGE], s[_CURRENT], s[_STEP] = first, filtered, age, before, step
    s[_RUNNING], last_ns[0] = runs, last
