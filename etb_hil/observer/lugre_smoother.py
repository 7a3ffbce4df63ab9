"""For recordings: LuGre's friction fitted along the smoothed motion, and what it does not explain left to wander.

A recording of some seconds determines the six numbers of eq. (2) of the seed paper far better than any instant of it
determines its friction. So friction is eq. (2) along the motion plus a random walk that may be small; motion and
friction are found in turn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from etb_hil.observer import kalman
from etb_hil.observer.bristle import COVARIANCE, DECAY, ERROR, GAIN, PREDICTED, RECORDED, TIME_STEP, VARIANCE
from etb_hil.observer.estimate import Estimate, SensorNoise
from etb_hil.observer.kalman import CURRENT, FRICTION, L0, L1, L2, LONGEST_GAP_NS, OMEGA, P00, THETA
from etb_hil.observer.normal_equations import accumulate, inverse, times
from etb_hil.observer.smoother import smooth, surprise
from etb_hil.plant.exactmath import exp, gauss, log
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.plant.physics import INERTIA, TORQUE_PER_AMPERE, spring_torque
from etb_hil.recording.samples import Float64, Int64

# What is fitted: torques as they are, the drop from T_st to T_c allowed to vanish; logarithms keep the rest positive.
_COULOMB, _DROP, _LOG_SPEED, _VISCOUS, _LOG_STIFFNESS, _LOG_DAMPING = range(6)
_FITTED = 6
_ANY_TORQUE = 1.0  # N·m, spread of what is assumed of T_c and the drop
_ANY_FACTOR = 1.0  # of the logarithms
_LEAST = 1e-3  # share of T_c below which g may not fall while the fit looks around

# What may be left over: variance of friction a second, and for each change of LuGre's friction, as shares of (2 T)^2
# and 2 T, T the friction's level. The recording chooses.
_WANDERS = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
_TURNINGS = (0.0, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
_FIRST = 1e-3  # both, to begin with

_TURNS = 3  # motion and friction in turn
_ITERATIONS = 4  # of the fit along one motion
_HALVINGS = 8
_LONGEST_STEP = 1.0  # of a parameter, in N·m or a logarithm
_NUDGE = 1e-3  # for derivatives by differences
_SUBSTEP_S = 125e-6
_MOST_SUBSTEPS = 16
_UNSETTLED = 100  # first samples, which say more of the start than of the friction


@dataclass(frozen=True, slots=True)
class _Recording:
    """The good samples (n) of a recording; `step` s since the one before, 0 where a stretch begins."""

    step: Float64
    current: Float64
    angle: Float64
    p: Float64
    inertia: float
    level: float
    jitter: float
    variance: float


def smooth_along_lugre(
    throttle: ThrottleParameters, noise: SensorNoise, time_ns: Int64, current: Float64, angle: Float64
) -> Estimate:
    """Return velocity and friction torque of a whole recording (n), without delay; NaN where samples are bad.

    Of the throttle's friction only its orders of magnitude are used, to begin with; springs, inertia and motor
    constant are taken as they are.
    """
    velocity, friction = np.full(len(time_ns), np.nan), np.full(len(time_ns), np.nan)
    good = np.isfinite(current) & np.isfinite(angle)
    estimate = Estimate(time_ns, velocity, friction, np.zeros(len(time_ns), np.int64))
    first = smooth(throttle, noise, time_ns, current, angle)
    known = good & np.isfinite(first.friction)
    if np.count_nonzero(known) <= _UNSETTLED:
        return estimate
    level = max(float(np.median(np.abs(first.friction[known]))), 1e-6)
    since = np.diff(time_ns[good], prepend=time_ns[good][0])
    recording = _Recording(
        np.where((since > 0) & (since <= LONGEST_GAP_NS), since * 1e-9, 0.0),
        current[good],
        angle[good],
        throttle.vector(),
        throttle.inertia,
        level,
        (throttle.torque_per_ampere * noise.current / throttle.inertia) ** 2,
        noise.angle * noise.angle,
    )
    before = np.where(np.isfinite(first.friction), first.friction, 0.0)[good]
    mean = 0.5 * (before + np.concatenate([before[:1], before[:-1]]))
    velocity[good], friction[good] = _in_turn(recording, mean, _start(throttle, level))
    return estimate


def _start(throttle: ThrottleParameters, level: float) -> Float64:
    return np.array(
        [
            0.9 * level,
            0.2 * level,
            log(throttle.stribeck_velocity),
            throttle.viscous,
            log(throttle.bristle_stiffness),
            log(throttle.bristle_damping),
        ]
    )


def _in_turn(recording: _Recording, mean: Float64, q: Float64) -> tuple[Float64, Float64]:
    """Return velocity and friction (n) at the samples; `mean` (n) N·m is a first guess of the friction in each step."""
    n = len(recording.step)
    trace = np.empty((n, RECORDED))
    theta, omega, left = np.empty(n), np.empty(n), np.empty(n)
    at = np.empty(n)
    _forward(recording, mean, _FIRST, 0.0, trace)
    _backward(trace, recording.inertia, theta, omega, left)
    prior = q.copy()
    spread = np.array([_ANY_TORQUE, _ANY_TORQUE, _ANY_FACTOR, abs(prior[_VISCOUS]), _ANY_FACTOR, _ANY_FACTOR])
    wander = turning = _FIRST
    for _ in range(_TURNS):
        along = _Along(recording, theta, omega, prior, spread)
        q = along.fit(q, wander, turning)
        for _ in range(2):
            wander = min(_WANDERS, key=lambda share: along.unlikelihood(q, share, turning))
            turning = min(_TURNINGS, key=lambda share: along.unlikelihood(q, wander, share))
        along.unlikelihood(q, wander, turning)
        at = along.at.copy()
        theta, omega = np.empty(n), np.empty(n)
        _backward(along.trace, recording.inertia, theta, omega, left)
    return omega, at + left


class _Along:
    """LuGre's six numbers along one motion: how unlikely they make the recording, and the likeliest ones."""

    def __init__(self, recording: _Recording, theta: Float64, omega: Float64, prior: Float64, spread: Float64) -> None:
        self._recording, self._theta, self._omega = recording, theta, omega
        self._prior, self._precision = prior, 1.0 / (spread * spread)
        self._mean = np.empty(len(theta))
        self.at, self.trace = np.empty(len(theta)), np.empty((len(theta), RECORDED))

    def unlikelihood(self, q: Float64, wander: float, turning: float) -> float:
        """Return minus twice the logarithm of the likelihood (Schweppe 1965) and prior, constants left out."""
        _lugre(self._theta, self._omega, self._recording.step, q, self._mean, self.at)
        _forward(self._recording, self._mean, wander, turning, self.trace)
        return _surprise(self.trace, q, self._prior, self._precision)

    def fit(self, q: Float64, wander: float, turning: float) -> Float64:
        """Return the likeliest numbers by Gauss and Newton's method with halved steps."""
        for _ in range(_ITERATIONS):
            cost = self.unlikelihood(q, wander, turning)
            matrix, vector = self._linearise(q)
            step = times(inverse(matrix), vector)
            if not np.all(np.isfinite(step)):
                return q
            step = np.minimum(np.maximum(step, -_LONGEST_STEP), _LONGEST_STEP)
            for _ in range(_HALVINGS):
                tried = q + step
                possible = tried[_COULOMB] > 0.0 and tried[_COULOMB] + tried[_DROP] > 0.0
                if possible and self.unlikelihood(tried, wander, turning) < cost:
                    q = tried
                    break
                step = 0.5 * step
            else:
                return q
        return q

    def _linearise(self, q: Float64) -> tuple[Float64, Float64]:
        """Return normal equations of the innovations; the filter is linear in the friction that it is told."""
        base, trace = self._mean.copy(), self.trace
        other, at = np.empty(len(base)), np.empty(len(base))
        jacobian = np.empty((len(base), _FITTED))
        for index in range(_FITTED):
            nudge = _NUDGE * (abs(self._prior[index]) if index in {_COULOMB, _VISCOUS} else self._prior[_COULOMB])
            nudge = nudge if index <= _DROP or index == _VISCOUS else _NUDGE
            nudged = q.copy()
            nudged[index] += nudge
            _lugre(self._theta, self._omega, self._recording.step, nudged, other, at)
            _respond(trace, (other - base) / nudge, self._recording.inertia, jacobian[:, index])
        used = np.isfinite(trace[:, ERROR])
        used[:_UNSETTLED] = False
        matrix, vector = accumulate(-jacobian[used], trace[used, ERROR], 1.0 / trace[used, VARIANCE])
        matrix[np.diag_indices(_FITTED)] += self._precision
        return matrix, vector + self._precision * (self._prior - q)


def _forward(recording: _Recording, mean: Float64, wander: float, turning: float, trace: Float64) -> None:
    r, scale = recording, 2.0 * recording.level / recording.inertia
    _filter(r.step, r.current, r.angle, mean, r.p, wander * scale * scale, turning * scale, r.jitter, r.variance, trace)


@njit(cache=True, error_model="numpy")
def _level(omega: float, q: Float64, inverse_speed: float) -> float:
    return max(q[_COULOMB] + q[_DROP] * gauss(omega * inverse_speed), _LEAST * abs(q[_COULOMB]) + 1e-6)


@njit(cache=True, error_model="numpy")
def _lugre(theta: Float64, omega: Float64, step: Float64, q: Float64, mean: Float64, at: Float64) -> None:
    """Fill `mean` (n) with LuGre's friction in N·m over the step before each sample, `at` (n) with that at the sample.

    Between samples the motion is a cubic through both angles with both velocities (Hermite).
    """
    inverse_speed, viscous = exp(-q[_LOG_SPEED]), q[_VISCOUS]
    stiffness, damping = exp(q[_LOG_STIFFNESS]), exp(q[_LOG_DAMPING])
    z = 0.0
    for k in range(len(theta)):
        mean[k], dt = 0.0, step[k]
        if dt <= 0.0:
            z = 0.0
        else:
            parts = max(1, min(int(dt / _SUBSTEP_S + 0.5), _MOST_SUBSTEPS))
            a, b, va, vb = theta[k - 1], theta[k], omega[k - 1], omega[k]
            place, speed, torque, total = a, va, at[k - 1], 0.0
            for part in range(1, parts + 1):
                x = part / parts
                y = 1.0 - x
                place_after = y * y * (1.0 + 2.0 * x) * a + x * x * (3.0 - 2.0 * x) * b + x * y * dt * (y * va - x * vb)
                speed_after = 6.0 * x * y * (b - a) / dt + y * (1.0 - 3.0 * x) * va + x * (3.0 * x - 2.0) * vb
                way = place_after - place
                g = _level(0.5 * (speed + speed_after), q, inverse_speed)
                settled = g / stiffness if way > 0.0 else -g / stiffness
                z = settled + (z - settled) * exp(-stiffness * abs(way) / g)
                g = _level(speed_after, q, inverse_speed)
                rate = speed_after - stiffness * abs(speed_after) / g * z
                torque_after = stiffness * z + damping * rate + viscous * speed_after
                total += 0.5 * (torque + torque_after)
                place, speed, torque = place_after, speed_after, torque_after
            mean[k] = total / parts
        g = _level(omega[k], q, inverse_speed)
        rate = omega[k] - stiffness * abs(omega[k]) / g * z
        at[k] = stiffness * z + damping * rate + viscous * omega[k]


@njit(cache=True, error_model="numpy")
def _filter(
    step: Float64,
    current: Float64,
    angle: Float64,
    mean: Float64,
    p: Float64,
    wander: float,
    turning: float,
    jitter: float,
    variance: float,
    trace: Float64,
) -> None:
    """Run the filter of `kalman` for what `mean` (n) N·m leaves of the friction, and keep what a smoother needs."""
    s = np.zeros(kalman.STATES)
    trace[:] = np.nan
    for k in range(len(step)):
        dt = step[k]
        if dt <= 0.0:
            kalman.restart(s, angle[k], current[k], variance)
            continue
        growth = wander + turning * abs(mean[k] - mean[k - 1]) / p[INERTIA] / dt
        kalman.carry(s, dt, growth, jitter)
        torque = p[TORQUE_PER_AMPERE] * 0.5 * (current[k] + s[CURRENT]) - mean[k]
        acceleration = (torque - spring_torque(s[THETA] + 0.5 * dt * s[OMEGA], p)) / p[INERTIA] - s[FRICTION]
        predicted = s[THETA] + dt * (s[OMEGA] + 0.5 * dt * acceleration)
        omega = s[OMEGA] + dt * acceleration
        error = angle[k] - predicted
        row = trace[k]
        row[TIME_STEP], row[PREDICTED], row[PREDICTED + 1], row[PREDICTED + 2] = dt, predicted, omega, s[FRICTION]
        for j in range(6):
            row[COVARIANCE + j] = s[P00 + j]
        row[ERROR], row[VARIANCE], row[DECAY] = error, s[P00] + variance, 1.0
        kalman.narrow(s, dt, growth, variance)
        row[GAIN], row[GAIN + 1], row[GAIN + 2] = s[L0], s[L1], s[L2]
        s[THETA], s[OMEGA] = predicted + s[L0] * error, omega + s[L1] * error
        s[FRICTION] += s[L2] * error
        s[CURRENT] = current[k]


@njit(cache=True, error_model="numpy")
def _respond(trace: Float64, change: Float64, inertia: float, out: Float64) -> None:
    """Fill out (n) with what the innovations answer to a change (n) N·m of the friction that the filter is told."""
    theta = omega = left = 0.0
    for k in range(len(out)):
        row = trace[k]
        out[k] = 0.0
        if math.isnan(row[TIME_STEP]):
            theta = omega = left = 0.0
            continue
        dt, acceleration = row[TIME_STEP], -change[k] / inertia - left
        error = -(theta + dt * (omega + 0.5 * dt * acceleration))
        theta, omega = -error + row[GAIN] * error, omega + dt * acceleration + row[GAIN + 1] * error
        left += row[GAIN + 2] * error
        out[k] = error


@njit(cache=True, error_model="numpy")
def _surprise(trace: Float64, q: Float64, prior: Float64, precision: Float64) -> float:
    total = surprise(trace, _UNSETTLED)
    for a in range(len(q)):
        total += precision[a] * (q[a] - prior[a]) * (q[a] - prior[a])
    return total


@njit(cache=True, error_model="numpy")
def _backward(trace: Float64, inertia: float, theta: Float64, omega: Float64, left: Float64) -> None:
    """Fill angle, velocity and left-over friction (n) of the fixed-interval smoother (Bryson and Frazier 1963)."""
    a, b, c = 0.0, 0.0, 0.0  # the adjoint state
    after = len(omega)
    for k in range(len(omega) - 1, -1, -1):
        row = trace[k]
        if math.isnan(row[TIME_STEP]):  # where a stretch begins, the first step tells where it came from
            theta[k] = omega[k] = left[k] = 0.0
            if k + 1 < after:
                theta[k], omega[k], left[k] = theta[k + 1], omega[k + 1], left[k + 1]
            a = b = c = 0.0
            continue
        a -= row[GAIN] * a + row[GAIN + 1] * b + row[GAIN + 2] * c + row[ERROR] / row[VARIANCE]
        p00, p01, p02 = row[COVARIANCE], row[COVARIANCE + 1], row[COVARIANCE + 2]
        p11, p12, p22 = row[COVARIANCE + 3], row[COVARIANCE + 4], row[COVARIANCE + 5]
        theta[k] = row[PREDICTED] - (p00 * a + p01 * b + p02 * c)
        omega[k] = row[PREDICTED + 1] - (p01 * a + p11 * b + p12 * c)
        left[k] = (row[PREDICTED + 2] - (p02 * a + p12 * b + p22 * c)) * inertia
        dt = row[TIME_STEP]
        b, c = dt * a + b, c - 0.5 * dt * dt * a - dt * b
