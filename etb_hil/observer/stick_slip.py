"""An observer that knows how a plate moves: it rests, slides, or turns round. It knows no law of friction."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from etb_hil.observer import kalman
from etb_hil.observer.angle_alone import DELAY_NS, LAST_NS, AngleAlone
from etb_hil.observer.estimate import SensorNoise
from etb_hil.observer.gains import FOLLOWED
from etb_hil.observer.kalman import (
    CURRENT,
    FLOOR,
    FLOOR_OMEGA,
    FLOOR_STEP,
    FRICTION,
    L0,
    L1,
    L2,
    OMEGA,
    RUNNING,
    STEADY,
    STEP,
    THETA,
    WANDER,
)
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.plant.physics import INERTIA, STICTION, TORQUE_PER_AMPERE, registers, spring_torque
from etb_hil.recording.samples import Float64, Int64

_SLIDING = 0.03  # share of a reversal's square that friction wanders in a second of rest or sliding
_TURNING_S = 0.010  # how long friction may take to turn round after the velocity has
_TURNED = 0.5  # share of a reversal that is expected of that time, give or take as much
_DEVIATIONS = 4.0  # standard deviations that velocity and acceleration of a plate at rest stay below
_LEVEL_S = 0.1  # time constant with which the level of friction is learnt while sliding
_LOWEST_LEVEL = 0.1  # share of the model's stiction

_KNOWN, _DIRECTION, _SINCE, _LEVEL, _CHOSEN_LEVEL, _READY = range(kalman.STATES, kalman.STATES + 6)
_STATES = kalman.STATES + 6


class StickSlipObserver(AngleAlone):
    """Estimates angle, velocity and friction torque by what friction does in each of three states, whatever its law.

    A plate at rest is held by all that is applied: friction follows it, change by change. A plate that slides has a
    friction that hardly changes. Where the velocity changes its sign in motion, friction turns round within 10 ms: half
    of twice its level is expected, give or take as much. At rest is what shows neither velocity nor acceleration beyond
    their uncertainty. The level is learnt from the data while sliding, and starts at the model's stiction; gains are
    Kalman's, low but in a reversal.
    """

    def __init__(self, throttle: ThrottleParameters, noise: SensorNoise) -> None:
        jitter = throttle.torque_per_ampere * noise.current / throttle.inertia
        super().__init__(_observe, throttle, np.array([jitter * jitter, noise.angle * noise.angle]), _STATES)
        self._state[_LEVEL] = throttle.stiction


@njit(cache=True, error_model="numpy", inline="always")
def _at_rest(s: Float64) -> tuple[float, float]:
    """Return the velocity in rad/s and the acceleration in rad/s^2 that a plate at rest may show."""
    return _DEVIATIONS * math.sqrt(s[FLOOR_OMEGA]), _DEVIATIONS * math.sqrt(s[FLOOR])


@njit(cache=True, error_model="numpy", inline="always")
def _wanders(level: float, per_inertia: float) -> tuple[float, float, float]:
    """Return a reversal in rad/s^2, and the growth of the friction's variance, rad^2/s^5, outside of one and in one."""
    reversal = 2.0 * level * per_inertia
    quiet = _SLIDING * reversal * reversal
    return reversal, quiet, quiet + _TURNED * _TURNED * reversal * reversal / _TURNING_S


@njit(cache=True, error_model="numpy", inline="always")
def _ahead(
    omega: float,
    drag: float,
    change: float,
    rests: bool,
    dt: float,
    still: float,
    direction: float,
    since: float,
    reversal: float,
) -> tuple[float, float, float]:
    """Return friction over inertia a step later, the direction of motion (0 at rest), and for how long it has been so.

    `change` rad/s^2 of what is applied.
    """
    if rests:
        return drag + change, 0.0, _TURNING_S
    if direction == 0.0:
        return drag, math.copysign(1.0, omega) if abs(omega) > still else 0.0, _TURNING_S
    if omega * direction < 0.0:
        direction, since = -direction, 0.0
    if since < _TURNING_S and drag * direction < 0.0:
        drag += direction * reversal * _TURNED * dt / _TURNING_S
    return drag, direction, since + dt


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
    jitter, angle_variance, lowest = tuning[0], tuning[1], _LOWEST_LEVEL * p[STICTION]
    torque_per_ampere, inertia, per_inertia, values = p[TORQUE_PER_AMPERE], p[INERTIA], 1.0 / p[INERTIA], registers(p)
    # What every sample needs stays out of memory: as elements of `s`, they would be stored and loaded sample by sample.
    theta, omega, drag, before, known = s[THETA], s[OMEGA], s[FRICTION], s[CURRENT], s[_KNOWN]
    direction, since, level, chosen, ready = s[_DIRECTION], s[_SINCE], s[_LEVEL], s[_CHOSEN_LEVEL], s[_READY]
    last, (still, calm) = whole[LAST_NS], _at_rest(s)
    reversal, quiet, turning = _wanders(chosen, per_inertia)
    for k in range(len(time_ns)):
        i, measured = current[k], angle[k]
        velocity[k] = friction[k] = np.nan
        delay_ns[k] = whole[DELAY_NS]
        if not math.isfinite(i + measured):
            continue
        step_ns, last = time_ns[k] - last, time_ns[k]
        if s[RUNNING] == 0.0 or step_ns > kalman.LONGEST_GAP_NS or step_ns <= 0:
            kalman.restart(s, measured, i, angle_variance)
            theta, omega, drag, before, direction, since, ready = measured, 0.0, 0.0, i, 0.0, _TURNING_S, 0.0
            known = (torque_per_ampere * i - spring_torque(measured, values)) * per_inertia
            continue
        dt = step_ns * 1e-9
        if level < FOLLOWED * chosen or level * FOLLOWED > chosen:
            chosen = level
            reversal, quiet, turning = _wanders(chosen, per_inertia)
            if s[FLOOR_STEP] > 0.0:
                whole[DELAY_NS] = kalman.settle(s, s[FLOOR_STEP], quiet, jitter, angle_variance)
                still, calm = _at_rest(s)
        begun, middle = drag, theta + 0.5 * dt * omega
        applied = (torque_per_ampere * 0.5 * (i + before) - spring_torque(middle, values)) * per_inertia
        rests, change, known = abs(omega) < still and abs(applied - drag) < calm, applied - known, applied
        drag, direction, since = _ahead(omega, drag, change, rests, dt, still, direction, since, reversal)
        if abs(omega) > still:
            level += dt / _LEVEL_S * (max(abs(drag) * inertia, lowest) - level)
        wander = turning if since < _TURNING_S else quiet
        if s[STEADY] == 0.0 or dt != s[STEP] or wander != s[WANDER]:
            if kalman.needs_settling(s, dt):
                whole[DELAY_NS] = kalman.settle(s, dt, quiet, jitter, angle_variance)
                still, calm = _at_rest(s)
            kalman.carry(s, dt, wander, jitter)
            kalman.narrow(s, dt, wander, angle_variance)
            ready = 1.0 if kalman.is_settled(s) else ready
        acceleration = applied - 0.5 * (begun + drag)
        predicted = theta + dt * (omega + 0.5 * dt * acceleration)
        error = measured - predicted
        theta = predicted + s[L0] * error
        omega, drag, before = omega + dt * acceleration + s[L1] * error, drag + s[L2] * error, i
        if ready > 0.0:
            velocity[k], friction[k] = omega, drag * inertia
    s[THETA], s[OMEGA], s[FRICTION], s[CURRENT], s[_KNOWN] = theta, omega, drag, before, known
    s[_DIRECTION], s[_SINCE], s[_LEVEL], s[_CHOSEN_LEVEL], s[_READY] = direction, since, level, chosen, ready
    whole[LAST_NS] = last
