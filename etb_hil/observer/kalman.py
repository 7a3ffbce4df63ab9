"""The filter behind the observers with three states, compiled.

States are angle, velocity, and friction torque over inertia.

Gains are Kalman's (1960) for eq. (3) of the seed paper with a friction torque that is a random walk between samples.
They are carried along sample by sample, so that a lost sample widens the uncertainty and nothing else, and left alone
once they are steady.
"""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.recording.samples import Float64

# Longer gaps than this start afresh: friction may have turned round unseen.
LONGEST_GAP_NS = 20_000_000

# State: what is estimated (rad, rad/s, rad/s^2), its covariance, the gains it gives, and what they hold for.
THETA, OMEGA, FRICTION = 0, 1, 2
P00, P01, P02, P11, P12, P22 = 3, 4, 5, 6, 7, 8
L0, L1, L2 = 9, 10, 11
STEP, WANDER, STEADY, RUNNING, CURRENT = 12, 13, 14, 15, 16
FLOOR, FLOOR_STEP, FLOOR_OMEGA = 17, 18, 19
STATES = 20

# A bad estimate is worse than none: NaN until the uncertainty is within this factor of its steady value.
_SETTLED = 1.5
_UNKNOWN_VELOCITY = 1e4  # (rad/s)^2
_UNKNOWN_FRICTION = 1e7  # (rad/s^2)^2
_STEADY_CHANGE = 1e-9


@njit(cache=True, error_model="numpy")
def restart(s: Float64, angle: float, current: float, angle_variance: float) -> None:
    """Start at a measured angle in rad and current in A.

    Velocity and friction are unknown.
    """
    s[THETA], s[OMEGA], s[FRICTION] = angle, 0.0, 0.0
    s[P00], s[P11], s[P22] = angle_variance, _UNKNOWN_VELOCITY, _UNKNOWN_FRICTION
    s[P01] = s[P02] = s[P12] = 0.0
    s[RUNNING], s[CURRENT], s[STEADY] = 1.0, current, 0.0


@njit(cache=True, error_model="numpy", inline="always")
def carry(s: Float64, dt: float, wander: float, jitter: float) -> None:
    """Carry the covariance over dt in s.

    `wander` is the growth of the friction's variance, rad^2/s^5, `jitter` the variance of the known acceleration.
    """
    dt2 = dt * dt
    half = 0.5 * dt2
    p00, p01, p02, p11, p12, p22 = s[P00], s[P01], s[P02], s[P11], s[P12], s[P22]
    # F = [1 dt -dt^2/2; 0 1 -dt; 0 0 1]
    a00 = p00 + dt * p01 - half * p02
    a01 = p01 + dt * p11 - half * p12
    a02 = p02 + dt * p12 - half * p22
    a11 = p11 - dt * p12
    a12 = p12 - dt * p22
    q = wander * dt
    s[P00] = a00 + dt * a01 - half * a02 + q * dt2 * dt2 / 20.0 + jitter * dt2 * dt2 * 0.25
    s[P01] = a01 - dt * a02 + q * dt2 * dt / 8.0 + jitter * dt2 * dt * 0.5
    s[P02] = a02 - q * dt2 / 6.0
    s[P11] = a11 - dt * a12 + q * dt2 / 3.0 + jitter * dt2
    s[P12] = a12 - q * dt * 0.5
    s[P22] = p22 + q


@njit(cache=True, error_model="numpy", inline="always")
def narrow(s: Float64, dt: float, wander: float, angle_variance: float) -> None:
    """Take a measured angle into the covariance and set the gains for it."""
    p00, p01, p02 = s[P00], s[P01], s[P02]
    scale = 1.0 / (p00 + angle_variance)
    l0, l1, l2 = p00 * scale, p01 * scale, p02 * scale
    change = abs(l0 - s[L0]) + abs(l1 - s[L1]) * dt + abs(l2 - s[L2]) * dt * dt
    same = dt == s[STEP] and wander == s[WANDER]
    s[STEADY] = 1.0 if change < _STEADY_CHANGE and same else 0.0
    s[P00], s[P01], s[P02] = p00 - l0 * p00, p01 - l0 * p01, p02 - l0 * p02
    s[P11], s[P12], s[P22] = s[P11] - l1 * p01, s[P12] - l1 * p02, s[P22] - l2 * p02
    s[L0], s[L1], s[L2], s[STEP], s[WANDER] = l0, l1, l2, dt, wander


@njit(cache=True, error_model="numpy")
def settle(s: Float64, dt: float, wander: float, jitter: float, angle_variance: float) -> int:
    """Note the steady uncertainty of a sampling step in s; return the lag in ns.

    The result is how far the friction then lags.
    """
    steady = np.zeros(STATES)
    restart(steady, 0.0, 0.0, angle_variance)
    for _ in range(100_000):
        carry(steady, dt, wander, jitter)
        narrow(steady, dt, wander, angle_variance)
        if steady[STEADY] == 1.0:
            break
    s[FLOOR], s[FLOOR_STEP], s[FLOOR_OMEGA] = steady[P22], dt, steady[P11]
    return int(-steady[L1] / steady[L2] * 1e9 + 0.5)


@njit(cache=True, error_model="numpy", inline="always")
def is_settled(s: Float64) -> bool:
    """Return whether the friction is known nearly as well as it ever will be."""
    return s[P22] <= _SETTLED * _SETTLED * s[FLOOR]


@njit(cache=True, error_model="numpy", inline="always")
def needs_settling(s: Float64, dt: float) -> bool:
    """Return whether the sampling step has changed for good.

    The step is the first step, or a new one that was seen twice.
    """
    return s[FLOOR] == 0.0 or (dt == s[STEP] and dt != s[FLOOR_STEP])
