"""For recordings: LuGre's friction fitted along the smoothed motion, and what it does not explain left to wander.

A recording of some seconds determines the six numbers of eq. (2) of the seed paper far better than any instant of it
determines its friction. So friction is eq. (2) along the motion plus a random walk that may be small; motion and
friction are found in turn, each time about the motion found before (`lugre_filter`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from etb_hil.observer.estimate import Estimate, SensorNoise
from etb_hil.observer.kalman import LONGEST_GAP_NS
from etb_hil.observer.lugre_filter import (
    ALONG,
    AT,
    COULOMB,
    DROP,
    ERROR,
    FITTED,
    KEPT,
    MEAN,
    TRACE,
    VARIANCE,
    VISCOUS,
    backward,
    forward,
    friction_along,
    respond,
)
from etb_hil.observer.normal_equations import accumulate, inverse, times
from etb_hil.observer.smoother import smooth, surprise
from etb_hil.plant.exactmath import log
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.recording.samples import Float64, Int64

_ANY_TORQUE = 1.0  # N·m, spread of what is assumed of T_c and the drop
_ANY_FACTOR = 1.0  # of the logarithms

# What may be left over: variance of friction a second, and for each change of LuGre's friction, as shares of (2 T)^2
# and 2 T, T the friction's level. The recording chooses.
_WANDERS = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
_TURNINGS = (0.0, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
_FIRST = 1e-3  # both, to begin with

# Motion and friction are found in turn: a few times with friction that holds nothing, which finds the neighbourhood,
# then until the motion stays what it was supposed to be.
_FREE_TURNS, _TURNS = 3, 12
_STAYS = 1e-3  # of the friction's level
_GAIN = 1.0  # of twice the log-likelihood: a turn that gains less has found nothing
_REFUSED = 2  # turns in a row
_ITERATIONS = 4  # of the fit along one motion
_HALVINGS = 8
_LONGEST_STEP = 1.0  # of a parameter, in N·m or a logarithm
_NUDGE = 1e-3  # for derivatives by differences
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
    velocity[good], friction[good] = _in_turn(recording, mean, before, _start(throttle, level))
    stretch = np.cumsum(recording.step == 0.0)
    unknown = np.flatnonzero(good)[np.bincount(stretch, known[good])[stretch] == 0.0]
    velocity[unknown] = friction[unknown] = np.nan  # stretches that are too short to show any friction
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


def _in_turn(recording: _Recording, mean: Float64, at: Float64, q: Float64) -> tuple[Float64, Float64]:
    """Return velocity and friction (n) at the samples; `mean`, `at` (n) N·m are a first guess of the friction."""
    n = len(recording.step)
    trace, guessed = np.empty((n, TRACE)), np.zeros((n, ALONG))
    guessed[:, MEAN], guessed[:, AT], guessed[:, KEPT] = mean, at, 1.0
    nowhere, theta, omega, friction = np.zeros(n), np.empty(n), np.empty(n), np.empty(n)
    _forward(recording, nowhere, nowhere, guessed, _FIRST, 0.0, trace)
    backward(trace, guessed, nowhere, recording.inertia, theta, omega, friction)
    spread = np.array([_ANY_TORQUE, _ANY_TORQUE, _ANY_FACTOR, abs(q[VISCOUS]), _ANY_FACTOR, _ANY_FACTOR])
    prior = q.copy()
    wander = turning = _FIRST
    supposed, least, refused, found = (theta, omega), math.inf, 0, (omega, friction)
    for turn in range(_TURNS):
        along = _Along(recording, theta, omega, prior, spread, is_held=turn >= _FREE_TURNS)
        q = along.fit(q, wander, turning)
        for _ in range(2):
            wander = min(_WANDERS, key=lambda share: along.unlikelihood(q, share, turning))
            turning = min(_TURNINGS, key=lambda share: along.unlikelihood(q, wander, share))
        cost = along.unlikelihood(q, wander, turning)
        after_theta, after_omega, friction, change = along.smooth()
        if turn >= _FREE_TURNS:
            if cost > least - _GAIN:  # too far: half the way
                theta, omega = 0.5 * (supposed[0] + theta), 0.5 * (supposed[1] + omega)
                refused += 1
                if refused == _REFUSED:
                    break
                continue
            least, refused = cost, 0
        supposed, found = (theta, omega), (after_omega, friction)
        theta, omega = after_theta, after_omega
        if turn >= _FREE_TURNS and change < _STAYS * recording.level:
            break
    return found


class _Along:
    """LuGre's six numbers along one motion: how unlikely they make the recording, and the likeliest ones."""

    def __init__(
        self,
        recording: _Recording,
        theta: Float64,
        omega: Float64,
        prior: Float64,
        spread: Float64,
        *,
        is_held: bool,
    ) -> None:
        self._is_held = is_held
        self._recording, self._theta, self._omega = recording, theta, omega
        self._prior, self._precision = prior, 1.0 / (spread * spread)
        self._along, self._trace = np.empty((len(theta), ALONG)), np.empty((len(theta), TRACE))
        self._along_for = np.full(FITTED, np.nan)  # the numbers that `_along` holds friction for

    def unlikelihood(self, q: Float64, wander: float, turning: float) -> float:
        """Return minus twice the logarithm of the likelihood (Schweppe 1965) and prior, constants left out."""
        if not np.array_equal(q, self._along_for):
            friction_along(self._theta, self._omega, self._recording.step, q, self._is_held, self._along)
            self._along_for = q.copy()
        _forward(self._recording, self._theta, self._omega, self._along, wander, turning, self._trace)
        total = surprise(self._trace[:, ERROR], self._trace[:, VARIANCE], _UNSETTLED)
        for precision, value, mean in zip(self._precision, q, self._prior, strict=True):
            total += precision * (value - mean) * (value - mean)
        return float(total)

    def smooth(self) -> tuple[Float64, Float64, Float64, float]:
        """Return angle, velocity and friction (n) for what was asked last, and how much the motion changed the last."""
        theta, omega, friction = np.empty_like(self._theta), np.empty_like(self._theta), np.empty_like(self._theta)
        inertia = self._recording.inertia
        change = backward(self._trace, self._along, self._omega, inertia, theta, omega, friction)
        return theta, omega, friction, change

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
                possible = tried[COULOMB] > 0.0 and tried[COULOMB] + tried[DROP] > 0.0
                if possible and self.unlikelihood(tried, wander, turning) < cost:
                    q = tried
                    break
                step = 0.5 * step
            else:
                return q
        return q

    def _linearise(self, q: Float64) -> tuple[Float64, Float64]:
        """Return normal equations of the innovations; the filter is linear in the friction that it is told."""
        trace, other = self._trace, np.empty_like(self._along)
        jacobian = np.empty((len(trace), FITTED))
        for index in range(FITTED):
            nudge = _NUDGE * (abs(self._prior[index]) if index in {COULOMB, VISCOUS} else self._prior[COULOMB])
            nudge = nudge if index <= DROP or index == VISCOUS else _NUDGE
            nudged = q.copy()
            nudged[index] += nudge
            friction_along(self._theta, self._omega, self._recording.step, nudged, self._is_held, other)
            change = (other[:, MEAN] - self._along[:, MEAN]) / nudge
            respond(trace, self._along, change, self._recording.inertia, jacobian[:, index])
        used = np.isfinite(trace[:, ERROR])
        used[:_UNSETTLED] = False
        matrix, vector = accumulate(-jacobian[used], trace[used, ERROR], 1.0 / trace[used, VARIANCE])
        matrix[np.diag_indices(FITTED)] += self._precision
        return matrix, vector + self._precision * (self._prior - q)


def _forward(
    recording: _Recording,
    theta: Float64,
    omega: Float64,
    along: Float64,
    wander: float,
    turning: float,
    trace: Float64,
) -> None:
    r, scale = recording, 2.0 * recording.level / recording.inertia
    shares = (wander * scale * scale, turning * scale)
    forward(r.step, r.current, r.angle, theta, omega, along, r.p, *shares, r.jitter, r.variance, trace)
