"""The default observer: friction torque from current and angle alone, no velocity sensor."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from etb_hil.observer.estimate import Estimate, SensorNoise
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.plant.physics import INERTIA, TORQUE_PER_AMPERE, spring_torque
from etb_hil.recording.samples import Float64, Int64

# Longer gaps than this start afresh: friction may have turned round unseen.
LONGEST_GAP_NS = 20_000_000

# A bad estimate is worse than none: NaN until the uncertainty is within this factor of its steady value.
_SETTLED = 1.5

# State: what was estimated, its covariance, the gains they give, and the last sample.
_THETA, _OMEGA, _FRICTION = 0, 1, 2  # rad, rad/s, friction torque over inertia in rad/s^2
_P00, _P01, _P02, _P11, _P12, _P22 = 3, 4, 5, 6, 7, 8
_L0, _L1, _L2 = 9, 10, 11
_STEP, _STEADY, _RUNNING, _CURRENT, _FLOOR, _FLOOR_STEP = 12, 13, 14, 15, 16, 17
_STATES = 18
_LAST_NS, _DELAY_NS = 0, 1

_UNKNOWN_VELOCITY = 1e4  # (rad/s)^2
_UNKNOWN_FRICTION = 1e7  # (rad/s^2)^2
_STEADY_CHANGE = 1e-9


class AngleObserver:
    """Estimates angle, velocity and friction torque with the gains that the sensors' noise calls for.

    The model is eq. (3) of the seed paper with the friction torque as a third state that wanders by a full reversal
    of the model's stiction a second; the gains are Kalman's (1960) for that model, so that a lost sample widens the
    uncertainty and nothing else. At a stop the estimate includes the stop's torque.
    """

    def __init__(self, throttle: ThrottleParameters, noise: SensorNoise) -> None:
        self._p = throttle.vector()
        reversal = 2.0 * throttle.stiction / throttle.inertia
        jitter = throttle.torque_per_ampere * noise.current / throttle.inertia
        self._tuning = np.array([reversal * reversal, noise.angle * noise.angle, jitter * jitter])
        self._state = np.zeros(_STATES)
        self._whole = np.zeros(2, np.int64)

    def push(self, time_ns: Int64, current: Float64, angle: Float64) -> Estimate:
        """Take samples and return velocity and friction torque at their instants; see `Observer.push`."""
        velocity, friction = np.empty(len(time_ns)), np.empty(len(time_ns))
        delay_ns = np.empty(len(time_ns), np.int64)
        _observe(time_ns, current, angle, self._p, self._tuning, self._state, self._whole, velocity, friction, delay_ns)
        return Estimate(time_ns, velocity, friction, delay_ns)


@njit(cache=True, error_model="numpy")
def _spread(s: Float64, dt: float, tuning: Float64) -> None:
    """Carry the covariance over dt, then update it and the gains for a measured angle."""
    wander, noise, jitter = tuning[0], tuning[1], tuning[2]
    dt2 = dt * dt
    half = 0.5 * dt2
    p00, p01, p02, p11, p12, p22 = s[_P00], s[_P01], s[_P02], s[_P11], s[_P12], s[_P22]
    # F = [1 dt -dt^2/2; 0 1 -dt; 0 0 1], Q of a friction torque that is a random walk, and the current's noise
    a00 = p00 + dt * p01 - half * p02
    a01 = p01 + dt * p11 - half * p12
    a02 = p02 + dt * p12 - half * p22
    a11 = p11 - dt * p12
    a12 = p12 - dt * p22
    q = wander * dt
    p00 = a00 + dt * a01 - half * a02 + q * dt2 * dt2 / 20.0 + jitter * dt2 * dt2 * 0.25
    p01 = a01 - dt * a02 + q * dt2 * dt / 8.0 + jitter * dt2 * dt * 0.5
    p02 = a02 - q * dt2 / 6.0
    p11 = a11 - dt * a12 + q * dt2 / 3.0 + jitter * dt2
    p12 = a12 - q * dt * 0.5
    p22 = p22 + q
    scale = 1.0 / (p00 + noise)
    l0, l1, l2 = p00 * scale, p01 * scale, p02 * scale
    change = abs(l0 - s[_L0]) + abs(l1 - s[_L1]) * dt + abs(l2 - s[_L2]) * dt2
    s[_STEADY] = 1.0 if change < _STEADY_CHANGE and dt == s[_STEP] else 0.0
    s[_P00], s[_P01], s[_P02] = p00 - l0 * p00, p01 - l0 * p01, p02 - l0 * p02
    s[_P11], s[_P12], s[_P22] = p11 - l1 * p01, p12 - l1 * p02, p22 - l2 * p02
    s[_L0], s[_L1], s[_L2], s[_STEP] = l0, l1, l2, dt


@njit(cache=True, error_model="numpy")
def _floor(dt: float, tuning: Float64) -> tuple[float, float]:
    """Return the steady variance of the friction state for a sampling step, and its lag in s."""
    s = np.zeros(_STATES)
    s[_P00], s[_P11], s[_P22] = tuning[1], _UNKNOWN_VELOCITY, _UNKNOWN_FRICTION
    for _ in range(100_000):
        _spread(s, dt, tuning)
        if s[_STEADY] == 1.0:
            break
    return s[_P22], -s[_L1] / s[_L2]


@njit(cache=True, error_model="numpy")
def _observe(
    time_ns: Int64,
    current: Float64,
    angle: Float64,
    p: Float64,
    tuning: Float64,
    s: Float64,
    whole: Int64,
    velocity: Float64,
    friction: Float64,
    delay_ns: Int64,
) -> None:
    torque_per_ampere, inertia = p[TORQUE_PER_AMPERE], p[INERTIA]
    per_inertia = 1.0 / inertia
    for k in range(len(time_ns)):
        i, measured = current[k], angle[k]
        velocity[k] = friction[k] = np.nan
        delay_ns[k] = whole[_DELAY_NS]
        if math.isnan(i) or math.isnan(measured):
            continue
        step_ns = time_ns[k] - whole[_LAST_NS]
        whole[_LAST_NS] = time_ns[k]
        if s[_RUNNING] == 0.0 or step_ns > LONGEST_GAP_NS or step_ns <= 0:
            s[_THETA], s[_OMEGA], s[_FRICTION] = measured, 0.0, 0.0
            s[_P01] = s[_P02] = s[_P12] = 0.0
            s[_P00], s[_P11], s[_P22] = tuning[1], _UNKNOWN_VELOCITY, _UNKNOWN_FRICTION
            s[_RUNNING], s[_CURRENT], s[_STEADY] = 1.0, i, 0.0
            continue
        dt = step_ns * 1e-9
        if s[_STEADY] == 0.0 or dt != s[_STEP]:
            if s[_FLOOR] == 0.0 or (dt == s[_STEP] and dt != s[_FLOOR_STEP]):
                s[_FLOOR], delay = _floor(dt, tuning)
                s[_FLOOR_STEP], whole[_DELAY_NS] = dt, np.int64(delay * 1e9 + 0.5)
            _spread(s, dt, tuning)
        middle = s[_THETA] + 0.5 * dt * s[_OMEGA]
        known = (torque_per_ampere * 0.5 * (i + s[_CURRENT]) - spring_torque(middle, p)) * per_inertia
        acceleration = known - s[_FRICTION]
        predicted = s[_THETA] + dt * (s[_OMEGA] + 0.5 * dt * acceleration)
        error = measured - predicted
        s[_THETA] = predicted + s[_L0] * error
        s[_OMEGA] += dt * acceleration + s[_L1] * error
        s[_FRICTION] += s[_L2] * error
        s[_CURRENT] = i
        if s[_P22] <= _SETTLED * _SETTLED * s[_FLOOR]:
            velocity[k] = s[_OMEGA]
            friction[k] = s[_FRICTION] * inertia
