"""An observer that knows how friction turns round: along the way through presliding, not at random."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from etb_hil.observer import kalman
from etb_hil.observer.estimate import Estimate, SensorNoise
from etb_hil.observer.kalman import (
    CURRENT,
    FRICTION,
    L0,
    L1,
    L2,
    OMEGA,
    P00,
    P01,
    P02,
    P11,
    P12,
    P22,
    RUNNING,
    STEADY,
    STEP,
    THETA,
    WANDER,
)
from etb_hil.plant.exactmath import exp_neg
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.plant.physics import BRISTLE_STIFFNESS, INERTIA, STICTION, TORQUE_PER_AMPERE, spring_torque
from etb_hil.recording.samples import Float64, Int64

# Shares of (2 T)^2, T the friction's level: what it wanders in a second of sliding, and over the way of a reversal.
_SLIDING = 0.01
_TURNING = 0.003
_REACH = 3.0  # presliding ends after this many T / sigma_0: 95 % of the way to the level
_LEVEL_S = 0.1  # time constant with which the level is learnt while sliding
_LOWEST_LEVEL = 0.1  # share of the model's stiction

_DIRECTION, _TURNED_AT, _LEVEL, _LATCHED, _DECAY, _COUPLING, _SETTLED = range(kalman.STATES, kalman.STATES + 7)
_ACCELERATION, _BEFORE = kalman.STATES + 7, kalman.STATES + 8
_STATES = kalman.STATES + 9
_LAST_NS, _DELAY_NS = 0, 1
_LONGEST_GAP_NS = kalman.LONGEST_GAP_NS

# What a smoother needs of each sample: prediction and its covariance, gains, what the measurement added, the step: 0
# where a stretch begins, NaN at a bad sample.
TIME_STEP, PREDICTED, COVARIANCE, GAIN, ERROR, VARIANCE, DECAY, COUPLING = 0, 1, 4, 10, 13, 14, 15, 16
RECORDED = 17


class BristleObserver:
    """Estimates angle, velocity and friction torque; carries friction along LuGre's bristles while they turn round.

    After each reversal the torque is expected to go to the other sign of its level along exp(-sigma_0 way / level),
    eq. (2) of the seed paper at a velocity near zero; the level is learnt from the data while sliding, and starts at
    the model's stiction. sigma_0 is the model's: 50 % off costs some of what is won. Between reversals the gains can be
    low, so that noise is a fraction of what an observer lets through that is ready for a reversal at any time;
    `wander` multiplies how much friction may change beside all that.
    """

    def __init__(self, throttle: ThrottleParameters, noise: SensorNoise, wander: float = 1.0) -> None:
        self._p = throttle.vector()
        jitter = throttle.torque_per_ampere * noise.current / throttle.inertia
        self._tuning = np.array([jitter * jitter, noise.angle * noise.angle, wander])
        self._state = np.zeros(_STATES)
        self._whole = np.zeros(2, np.int64)

    def push(self, time_ns: Int64, current: Float64, angle: Float64) -> Estimate:
        """Take samples and return velocity and friction torque at their instants; see `Observer.push`."""
        return self.record(time_ns, current, angle, np.empty((0, RECORDED)))

    def record(self, time_ns: Int64, current: Float64, angle: Float64, trace: Float64) -> Estimate:
        """Do what `push` does, and fill `trace` (n, RECORDED) with what a smoother needs unless it is empty."""
        velocity, friction = np.empty(len(time_ns)), np.empty(len(time_ns))
        delay_ns = np.empty(len(time_ns), np.int64)
        state = (self._state, self._whole)
        _observe(time_ns, current, angle, self._p, self._tuning, *state, velocity, friction, delay_ns, trace)
        return Estimate(time_ns, velocity, friction, delay_ns)


@njit(cache=True, error_model="numpy")
def _turn(s: Float64, dt: float, p: Float64, share: float) -> float:
    """Carry the friction, and its part of the covariance, along the bristles; return its wander over this step."""
    level, stiffness, per_inertia = s[_LEVEL], p[BRISTLE_STIFFNESS], 1.0 / p[INERTIA]
    omega = s[OMEGA] + 0.5 * dt * s[_ACCELERATION]
    s[_BEFORE] = s[FRICTION]
    if omega * s[_DIRECTION] < 0.0 or s[_DIRECTION] == 0.0:
        s[_DIRECTION], s[_TURNED_AT] = 1.0 if omega > 0.0 else -1.0, s[THETA]
        s[_LATCHED] = level
    reversal = 2.0 * s[_LATCHED] * per_inertia
    wander = share * _SLIDING * reversal * reversal
    reach = _REACH * s[_LATCHED] / stiffness
    s[_DECAY], s[_COUPLING] = 1.0, 0.0
    if abs(s[THETA] - s[_TURNED_AT]) >= reach:
        learnt = level + dt / (_LEVEL_S + dt) * (abs(s[FRICTION]) * p[INERTIA] - level)
        s[_LEVEL] = max(learnt, _LOWEST_LEVEL * p[STICTION])
        return wander
    away = s[_DIRECTION] * level * per_inertia - s[FRICTION]
    decay = exp_neg(stiffness * abs(omega) * dt / level)
    coupling = away * stiffness * dt / level * decay * s[_DIRECTION]  # what an error of the velocity does to it
    s[FRICTION] += away * (1.0 - decay)
    p11, p12 = s[P11], s[P12]
    s[P02] = coupling * s[P01] + decay * s[P02]
    s[P12] = coupling * p11 + decay * p12
    s[P22] = coupling * coupling * p11 + 2.0 * coupling * decay * p12 + decay * decay * s[P22]
    s[_DECAY], s[_COUPLING] = decay, coupling
    return wander + share * _TURNING * reversal * reversal * abs(omega) / reach


@njit(cache=True, error_model="numpy")
def _begin(s: Float64, i: float, measured: float, angle_variance: float, p: Float64) -> None:
    kalman.restart(s, measured, i, angle_variance)
    s[_DIRECTION] = s[_SETTLED] = s[_ACCELERATION] = 0.0
    s[_LEVEL] = p[STICTION] if s[_LEVEL] == 0.0 else s[_LEVEL]


@njit(cache=True, error_model="numpy")
def _step(
    s: Float64, whole: Int64, dt: float, i: float, measured: float, p: Float64, tuning: Float64, trace: Float64, k: int
) -> None:
    """Move by one sample, number k; `trace` (n, RECORDED), unless empty, keeps what a smoother needs."""
    keeps = len(trace) > 0
    jitter, angle_variance = tuning[0], tuning[1]
    wander = _turn(s, dt, p, tuning[2])
    if kalman.needs_settling(s, dt):
        whole[_DELAY_NS] = kalman.settle(s, dt, wander, jitter, angle_variance)
    moves = keeps or s[STEADY] == 0.0 or dt != s[STEP] or wander != s[WANDER]
    if moves:
        kalman.carry(s, dt, wander, jitter)
    middle = s[THETA] + 0.5 * dt * s[OMEGA]
    known = (p[TORQUE_PER_AMPERE] * 0.5 * (i + s[CURRENT]) - spring_torque(middle, p)) / p[INERTIA]
    acceleration = known - 0.5 * (s[FRICTION] + s[_BEFORE])
    s[_ACCELERATION] = acceleration
    predicted = s[THETA] + dt * (s[OMEGA] + 0.5 * dt * acceleration)
    omega = s[OMEGA] + dt * acceleration
    error = measured - predicted
    if keeps:
        row = trace[k]
        row[TIME_STEP], row[PREDICTED], row[PREDICTED + 1], row[PREDICTED + 2] = dt, predicted, omega, s[FRICTION]
        for j in range(6):
            row[COVARIANCE + j] = s[P00 + j]
        row[ERROR], row[VARIANCE], row[DECAY], row[COUPLING] = error, s[P00] + angle_variance, s[_DECAY], s[_COUPLING]
    if moves:
        kalman.narrow(s, dt, wander, angle_variance)
    if keeps:
        trace[k, GAIN], trace[k, GAIN + 1], trace[k, GAIN + 2] = s[L0], s[L1], s[L2]
    s[THETA], s[OMEGA] = predicted + s[L0] * error, omega + s[L1] * error
    s[FRICTION] += s[L2] * error
    s[CURRENT] = i


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
    trace: Float64,
) -> None:
    trace[:] = np.nan
    for k in range(len(time_ns)):
        velocity[k] = friction[k] = np.nan
        delay_ns[k] = whole[_DELAY_NS]
        if not math.isfinite(current[k] + angle[k]):
            continue
        step_ns = time_ns[k] - whole[_LAST_NS]
        whole[_LAST_NS] = time_ns[k]
        if s[RUNNING] == 0.0 or step_ns > _LONGEST_GAP_NS or step_ns <= 0:
            _begin(s, current[k], angle[k], tuning[1], p)
            if len(trace) > 0:
                trace[k, TIME_STEP] = 0.0
            continue
        _step(s, whole, step_ns * 1e-9, current[k], angle[k], p, tuning, trace, k)
        if kalman.is_settled(s):
            s[_SETTLED] = 1.0
        if s[_SETTLED] == 1.0:
            velocity[k] = s[OMEGA]
            friction[k] = s[FRICTION] * p[INERTIA]
