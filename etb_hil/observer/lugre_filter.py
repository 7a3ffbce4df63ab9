"""The filter behind `lugre_smoother`, compiled: Newton's law about a supposed motion whose friction is LuGre's.

Four things are estimated: angle, velocity, what friction is off beside LuGre's law (a random walk), and what it is off
because the motion is not the supposed one. The last is what holds a plate that sticks: bristles are a stiff spring, so
that noise of the angle is not taken for motion. Both are kept as accelerations, torque over inertia.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from etb_hil.plant.exactmath import exp, gauss
from etb_hil.plant.physics import INERTIA, TORQUE_PER_AMPERE, spring_torque
from etb_hil.recording.samples import Float64

# What is fitted: torques as they are, the drop from T_st to T_c allowed to vanish; logarithms keep the rest positive.
COULOMB, DROP, LOG_SPEED, VISCOUS, LOG_STIFFNESS, LOG_DAMPING = range(6)
FITTED = 6

# LuGre's friction along a motion, by sample: N·m as a mean over the step before it and at it, what a bristle keeps over
# the step, N·m for a rad of way in it, N·m·s/rad at the sample
MEAN, AT, KEPT, STIFF, DAMPED = range(5)
ALONG = 5

# What a smoother needs of each sample: prediction (4) and its covariance (4, 4), gains (4), what the measurement added
_PREDICTED, _COVARIANCE, _GAIN, ERROR, VARIANCE, _STEP = 0, 4, 20, 24, 25, 26
TRACE = 27

_THETA, _OMEGA, _LEFT, _GIVEN = range(4)
_LEAST = 1e-3  # share of T_c below which g may not fall while the fit looks around
_SUBSTEP_S = 125e-6
_MOST_SUBSTEPS = 16
_UNKNOWN_VELOCITY, _UNKNOWN_FRICTION = 1e4, 1e7  # (rad/s)^2, (rad/s^2)^2


@njit(cache=True, error_model="numpy")
def _level(omega: float, q: Float64, inverse_speed: float) -> float:
    return max(q[COULOMB] + q[DROP] * gauss(omega * inverse_speed), _LEAST * abs(q[COULOMB]) + 1e-6)


@njit(cache=True, error_model="numpy")
def friction_along(theta: Float64, omega: Float64, step: Float64, q: Float64, is_held: bool, out: Float64) -> None:
    """Fill out (n, ALONG) with LuGre's friction (seed paper, eq. 2) along a motion.

    With `is_held` also with what it answers to another motion; without, friction holds nothing to this one. Between
    samples the motion is a cubic through both angles with both velocities (Hermite).
    """
    inverse_speed, viscous = exp(-q[LOG_SPEED]), q[VISCOUS]
    stiffness, damping = exp(q[LOG_STIFFNESS]), exp(q[LOG_DAMPING])
    z = 0.0
    for k in range(len(theta)):
        dt = step[k]
        out[k, MEAN], out[k, KEPT], out[k, STIFF] = 0.0, 1.0, 0.0
        if dt <= 0.0:
            z = 0.0
        else:
            parts = max(1, min(int(dt / _SUBSTEP_S + 0.5), _MOST_SUBSTEPS))
            a, b, va, vb = theta[k - 1], theta[k], omega[k - 1], omega[k]
            place, speed, torque, total = a, va, out[k - 1, AT], 0.0
            kept, stiff = 1.0, 0.0
            for part in range(1, parts + 1):
                x = part / parts
                y = 1.0 - x
                place_after = y * y * (1.0 + 2.0 * x) * a + x * x * (3.0 - 2.0 * x) * b + x * y * dt * (y * va - x * vb)
                speed_after = 6.0 * x * y * (b - a) / dt + y * (1.0 - 3.0 * x) * va + x * (3.0 * x - 2.0) * vb
                way = place_after - place
                g = _level(0.5 * (speed + speed_after), q, inverse_speed)
                direction = 1.0 if way > 0.0 else -1.0
                settled = direction * g / stiffness
                stays = exp(-stiffness * abs(way) / g)
                stiff = stays * (stiff + stiffness * (1.0 - direction * stiffness * z / g) / parts)
                kept *= stays
                z = settled + (z - settled) * stays
                g = _level(speed_after, q, inverse_speed)
                rate = speed_after - stiffness * abs(speed_after) / g * z
                torque_after = stiffness * z + damping * rate + viscous * speed_after
                total += 0.5 * (torque + torque_after)
                place, speed, torque = place_after, speed_after, torque_after
            out[k, MEAN] = total / parts
            if is_held:
                out[k, KEPT], out[k, STIFF] = kept, max(stiff, 0.0)
        g = _level(omega[k], q, inverse_speed)
        drag = stiffness * abs(omega[k]) / g
        out[k, AT] = stiffness * z + damping * (omega[k] - drag * z) + viscous * omega[k]
        towards = stiffness * z / g if omega[k] > 0.0 else -stiffness * z / g
        out[k, DAMPED] = damping * max(1.0 - towards, 0.0) + viscous if is_held else 0.0


@njit(cache=True, error_model="numpy", inline="always")
def _transition(dt: float, along: Float64, per_inertia: float, f: Float64) -> None:
    """Fill f (4, 4) with how the four are carried over dt in s; f[0] less the unit is the way."""
    kept, stiff, damped = along[KEPT], along[STIFF] * per_inertia, along[DAMPED] * per_inertia
    half = 0.5 * dt * dt
    w1, w2 = dt - half * damped, -half
    f[0, 0], f[0, 1], f[0, 2], f[0, 3] = 1.0, w1, w2, w2
    f[3, 0], f[3, 1], f[3, 2], f[3, 3] = 0.0, stiff * w1, stiff * w2, kept + stiff * w2
    f[1, 0] = 0.0
    f[1, 1] = 1.0 - 0.5 * dt * f[3, 1] - damped * w1
    f[1, 2] = -dt - 0.5 * dt * f[3, 2] - damped * w2
    f[1, 3] = -0.5 * dt * (1.0 + f[3, 3]) - damped * w2
    f[2, 0], f[2, 1], f[2, 2], f[2, 3] = 0.0, 0.0, 1.0, 0.0


@njit(cache=True, error_model="numpy", inline="always")
def _carry(p: Float64, f: Float64, dt: float, growth: float, jitter: float, half: Float64) -> None:
    """Carry the covariance p (4, 4) by f (4, 4) and add what the step itself makes uncertain; `half` is for work."""
    for a in range(4):
        for b in range(4):
            half[a, b] = f[a, 0] * p[0, b] + f[a, 1] * p[1, b] + f[a, 2] * p[2, b] + f[a, 3] * p[3, b]
    for a in range(4):
        for b in range(a + 1):
            p[a, b] = half[a, 0] * f[b, 0] + half[a, 1] * f[b, 1] + half[a, 2] * f[b, 2] + half[a, 3] * f[b, 3]
            p[b, a] = p[a, b]
    dt2, q = dt * dt, growth * dt
    p[0, 0] += q * dt2 * dt2 / 20.0 + jitter * dt2 * dt2 * 0.25
    p[1, 1] += q * dt2 / 3.0 + jitter * dt2
    p[2, 2] += q
    across = q * dt2 * dt / 8.0 + jitter * dt2 * dt * 0.5
    p[0, 1] += across
    p[1, 0] += across
    p[0, 2] -= q * dt2 / 6.0
    p[2, 0] -= q * dt2 / 6.0
    p[1, 2] -= q * dt * 0.5
    p[2, 1] -= q * dt * 0.5


@njit(cache=True, error_model="numpy")
def forward(
    step: Float64,
    current: Float64,
    angle: Float64,
    theta: Float64,
    omega: Float64,
    along: Float64,
    p: Float64,
    wander: float,
    turning: float,
    jitter: float,
    variance: float,
    trace: Float64,
) -> None:
    """Run the filter over samples (n) about a motion `theta`, `omega` (n) with its friction `along` (n, ALONG).

    `wander` is the growth a second of the variance of what LuGre leaves, `turning` the same for each change of
    LuGre's friction; `trace` (n, TRACE) keeps what follows from it.
    """
    per_inertia = 1.0 / p[INERTIA]
    x, cov, f, half = np.zeros(4), np.zeros((4, 4)), np.zeros((4, 4)), np.zeros((4, 4))
    before = 0.0
    for k in range(len(step)):
        dt, row = step[k], trace[k]
        if dt <= 0.0:
            row[:] = np.nan
            x[:] = 0.0
            cov[:] = 0.0
            x[_THETA], before = angle[k], current[k]
            cov[0, 0], cov[1, 1], cov[2, 2] = variance, _UNKNOWN_VELOCITY, _UNKNOWN_FRICTION
            continue
        here = along[k]
        damped = here[DAMPED] * per_inertia
        torque = p[TORQUE_PER_AMPERE] * 0.5 * (current[k] + before) - here[MEAN]
        free = (torque - spring_torque(x[_THETA] + 0.5 * dt * x[_OMEGA], p)) * per_inertia - x[_LEFT]
        early = free - x[_GIVEN] - damped * (x[_OMEGA] - omega[k - 1])
        predicted = x[_THETA] + dt * (x[_OMEGA] + 0.5 * dt * early)
        way = (predicted - x[_THETA]) - (theta[k] - theta[k - 1])
        given = here[KEPT] * x[_GIVEN] + here[STIFF] * per_inertia * way
        x[_OMEGA] += dt * (free - 0.5 * (x[_GIVEN] + given)) - damped * way
        x[_THETA], x[_GIVEN] = predicted, given
        _transition(dt, here, per_inertia, f)
        growth = wander + turning * abs(here[MEAN] - along[k - 1, MEAN]) * per_inertia / dt
        _carry(cov, f, dt, growth, jitter, half)
        error, spread = angle[k] - predicted, cov[0, 0] + variance
        row[ERROR], row[VARIANCE], row[_STEP] = error, spread, dt
        for a in range(4):
            row[_PREDICTED + a], row[_GAIN + a] = x[a], cov[a, 0] / spread
            for b in range(4):
                row[_COVARIANCE + 4 * a + b] = cov[a, b]
        for a in range(4):
            gain = row[_GAIN + a]
            x[a] += gain * error
            for b in range(4):
                cov[a, b] -= gain * row[_COVARIANCE + b]
        before = current[k]


@njit(cache=True, error_model="numpy")
def respond(trace: Float64, along: Float64, change: Float64, inertia: float, out: Float64) -> None:
    """Fill out (n) with what the innovations answer to a change (n) N·m of the friction along the supposed motion."""
    x, after, f = np.zeros(4), np.zeros(4), np.zeros((4, 4))
    per_inertia = 1.0 / inertia
    for k in range(len(out)):
        row, dt = trace[k], trace[k, _STEP]
        out[k] = 0.0
        if math.isnan(dt):
            x[:] = 0.0
            continue
        _transition(dt, along[k], per_inertia, f)
        pushed = -change[k] * per_inertia
        for a in range(4):
            after[a] = f[a, 0] * x[0] + f[a, 1] * x[1] + f[a, 2] * x[2] + f[a, 3] * x[3]
        way = 0.5 * dt * dt * pushed
        given = along[k, STIFF] * per_inertia * way
        after[_THETA] += way
        after[_GIVEN] += given
        after[_OMEGA] += dt * (pushed - 0.5 * given) - along[k, DAMPED] * per_inertia * way
        error = -after[_THETA]
        for a in range(4):
            x[a] = after[a] + row[_GAIN + a] * error
        out[k] = error


@njit(cache=True, error_model="numpy")
def backward(
    trace: Float64, along: Float64, supposed: Float64, inertia: float, theta: Float64, omega: Float64, friction: Float64
) -> float:
    """Fill angle, velocity and friction torque (n) of the fixed-interval smoother (Bryson and Frazier 1963).

    `supposed` (n) rad/s is the velocity that `along` (n, ALONG) was found for. Returned is what the motion's being
    another one makes of the friction, N·m as the root of the mean square.
    """
    total, count = 0.0, 0
    y, before, x, f = np.zeros(4), np.zeros(4), np.zeros(4), np.zeros((4, 4))  # y: the adjoint state
    per_inertia, after = 1.0 / inertia, len(omega)
    for k in range(len(omega) - 1, -1, -1):
        row = trace[k]
        if math.isnan(row[_STEP]):  # where a stretch begins, the first step tells where it came from
            theta[k] = omega[k] = friction[k] = 0.0
            if k + 1 < after:
                theta[k], omega[k], friction[k] = theta[k + 1], omega[k + 1], friction[k + 1]
            y[:] = 0.0
            continue
        pulled = row[ERROR] / row[VARIANCE]
        for a in range(4):
            pulled += row[_GAIN + a] * y[a]
        y[0] -= pulled
        for a in range(4):
            x[a] = row[_PREDICTED + a]
            for b in range(4):
                x[a] -= row[_COVARIANCE + 4 * a + b] * y[b]
        theta[k], omega[k] = x[_THETA], x[_OMEGA]
        answer = x[_GIVEN] * inertia + along[k, DAMPED] * (x[_OMEGA] - supposed[k])
        friction[k] = along[k, AT] + x[_LEFT] * inertia + answer
        total, count = total + answer * answer, count + 1
        _transition(row[_STEP], along[k], per_inertia, f)
        for a in range(4):
            before[a] = f[0, a] * y[0] + f[1, a] * y[1] + f[2, a] * y[2] + f[3, a] * y[3]
        y[:] = before
    return math.sqrt(total / max(count, 1))
