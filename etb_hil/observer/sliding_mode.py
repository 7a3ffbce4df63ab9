"""Sliding-mode observers of the velocity equation: the seed paper's, and two that chatter less.

All three observe eq. (3) of the seed paper from current and velocity, and read friction off what holds the observed
velocity to the measured one. The velocity is a measured one where it is given, as in the paper; else a robust
differentiator takes it from the angle. A measured velocity is taken to be exact: state a cut-off where it is not.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from etb_hil.observer.differentiator import differentiate, reaches
from etb_hil.observer.estimate import Estimate, SensorNoise
from etb_hil.observer.gains import (
    FINDING_S,
    FOLLOWED,
    LATE,
    LEAST_BOUND,
    SETTLING,
    STRONGEST,
    SlidingModeSettings,
    filtered,
    followed,
    gains_of,
    keep,
    tuning_of,
)
from etb_hil.observer.kalman import LONGEST_GAP_NS
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.plant.physics import INERTIA, TORQUE_PER_AMPERE, registers, spring_torque
from etb_hil.recording.samples import Float64, Int64

# Whether the sign switches, whether it is integrated. None, not False: numba compiles each law apart, so that none has
# to keep the others' values.
_EXPLICIT, _IMPLICIT, _SUPER_TWISTING = (True, None), (None, None), (None, True)
_SEEN, _LEFT, _PULL, _VELOCITY, _OBSERVED, _INTEGRAL, _FIRST, _SECOND, _THIRD, _AGE, _CURRENT, _STEP = range(12)
_RUNNING, _BOUND, _CHOSEN_FOR, _FINDING = 12, 13, 14, 15
_STATES = 16
_LAST_NS, _DELAY_NS = 0, 1
_NO_STEP = -(2**62)  # ns: none that ever comes


class _VelocityObserver:
    """What the three have in common: all but the law that drives the observed velocity to the measured one."""

    _law: tuple[bool | None, bool | None]

    def __init__(
        self, throttle: ThrottleParameters, noise: SensorNoise, settings: SlidingModeSettings | None = None
    ) -> None:
        self._p = throttle.vector()
        self._tuning = tuning_of(throttle, noise, settings)
        self._state = np.zeros(_STATES)
        self._whole = np.zeros(2, np.int64)

    def push(
        self, time_ns: Int64, current: Float64, angle: Float64, measured_velocity: Float64 | None = None
    ) -> Estimate:
        """Take samples, with the velocity (n) in rad/s where one is measured; see `Observer.push`."""
        velocity, friction = np.empty(len(time_ns)), np.empty(len(time_ns))
        delay_ns = np.empty(len(time_ns), np.int64)
        _springs(angle, self._p, friction)  # stay there until a sample's turn comes
        state = (self._p, self._tuning, self._state, self._whole)
        _observe(time_ns, current, angle, measured_velocity, *state, *self._law, velocity, friction, delay_ns)
        return Estimate(time_ns, velocity, friction, delay_ns)


class SlidingModeObserver(_VelocityObserver):
    """Seed paper, eq. (4) to (6): M sgn through a low-pass filter.

    Without any noise, M sgn leaves a ripple that falls with the step; noise of the velocity passes into the sign and is
    weighed by M, whatever its size.
    """

    _law = _EXPLICIT


class ImplicitSlidingModeObserver(_VelocityObserver):
    """The same with the sign taken at the end of the step (Acary and Brogliato 2010): a projection, no chattering.

    Noise of the velocity passes as J / step, up to M.
    """

    _law = _IMPLICIT


class SuperTwistingObserver(_VelocityObserver):
    """Super-twisting (Levant 1993): the switching is integrated, so that the friction torque comes out continuous.

    The bound of its rate is a reversal within the filter's delay: what is quicker the filter blurs anyway.
    """

    _law = _SUPER_TWISTING


@njit(cache=True, error_model="numpy", forceinline=True)
def _hold(
    switches: bool | None,
    twists: bool | None,
    observed: float,
    integral: float,
    error: float,
    velocity: float,
    known: float,
    dt: float,
    per_dt: float,
    nudge: float,
    lift: float,
    switching: float,
    near: float,
    half: float,
    square: float,
) -> tuple[float, float, float]:
    """Move the observed velocity by one step; return it, the integral, and the torque that held it where it was.

    `error` is how far it was off at the step's beginning, `velocity` the true one at its end. `nudge` is the velocity
    in rad/s that a step gives a torque of 1 N·m, `lift` its inverse; `near`, `half` and `square` are the
    differentiator's, which is super-twisting itself.
    """
    free = observed + nudge * known
    if twists is not None:
        level, pull, change = differentiate(velocity - (free + dt * integral), per_dt, near, half, square)
        held = velocity - (level - pull)
        # All that was injected: noise makes the proportional part lean to one side, and the integral makes up for it.
        return held, integral + change, (free - held) * lift
    if switches is None:
        torque = min(max((free - velocity) * lift, -switching), switching)
    else:
        torque = math.copysign(switching, error) if error != 0.0 else 0.0
    return free - nudge * torque, integral, torque


@njit(cache=True, error_model="numpy")
def _springs(angle: Float64, p: Float64, torque: Float64) -> None:
    """Fill in the springs' torque in N·m, apart from all that waits for the sample before: several at a time."""
    values = registers(p)
    for k in range(len(angle)):
        torque[k] = spring_torque(angle[k], values)


@njit(cache=True, error_model="numpy")
def _observe(
    time_ns: Int64,
    current: Float64,
    angle: Float64,
    given: Float64 | None,
    p: Float64,
    tuning: Float64,
    s: Float64,
    whole: Int64,
    switches: bool | None,
    twists: bool | None,
    velocity: Float64,
    friction: Float64,
    delay_ns: Int64,
) -> None:
    half_per_ampere, per_inertia = 0.5 * p[TORQUE_PER_AMPERE], 1.0 / p[INERTIA]
    half_steps = (2.0 if given is None else 1.0) + (0.0 if switches is None else 1.0)
    counted = per_dt = kept = nudge = lift = lowest = highest = switching = share = last_share = 0.0
    near = half = square = near_held = half_held = square_held = 0.0
    # What every sample needs stays out of memory: as elements of `s`, they would be stored and loaded sample by sample.
    # fmt: off
    seen, left, pull, omega, observed, integral, first, second, third, age, before, step, runs, bound, chosen_for = (
        s[_SEEN], s[_LEFT], s[_PULL], s[_VELOCITY], s[_OBSERVED], s[_INTEGRAL], s[_FIRST], s[_SECOND], s[_THIRD],
        s[_AGE], s[_CURRENT], s[_STEP], s[_RUNNING], s[_BOUND], s[_CHOSEN_FOR],
    )
    # fmt: on
    least, finding, last, late_ns = tuning[LEAST_BOUND], s[_FINDING], whole[_LAST_NS], whole[_DELAY_NS]
    dt, stepped, waits = step, _NO_STEP, False
    for k in range(len(time_ns)):
        i, measured = current[k], angle[k]
        if not math.isfinite(i + measured) or _is_missing(given, k):
            velocity[k], friction[k], delay_ns[k] = np.nan, np.nan, late_ns
            continue
        step_ns, last = time_ns[k] - last, time_ns[k]
        if step_ns != stepped:  # the step hardly ever changes, and what hangs on it is dear
            if runs == 0.0 or step_ns > LONGEST_GAP_NS or step_ns <= 0:
                observed = omega = 0.0 if given is None else given[k]
                integral = first = second = third = age = step = left = pull = counted = 0.0
                seen, before, runs, finding = measured, i, 1.0, tuning[FINDING_S] if given is None else 0.0
                velocity[k], friction[k], delay_ns[k], stepped = np.nan, np.nan, late_ns, _NO_STEP
                continue
            dt = step_ns * 1e-9
            per_dt, kept, nudge, lift = 1.0 / dt, keep(dt), dt * per_inertia, p[INERTIA] / dt
            is_late = dt > LATE * step and step > 0.0
            if given is None and (is_late or finding > 0.0):
                finding, counted = max(finding, dt) if is_late else finding - dt, 0.0
            waits = is_late or finding > 0.0
            stepped, step, highest = _NO_STEP if waits else step_ns, dt, highest if dt == counted else 0.0
        known = half_per_ampere * (i + before) - friction[k]
        bound = max(bound * kept, abs(known), least)
        if bound < lowest or bound > highest:
            chosen_for = followed(bound, chosen_for)
            lowest, highest = FOLLOWED * chosen_for, chosen_for / FOLLOWED
            switching, delay, share, last_share = gains_of(dt, chosen_for, tuning, given is None, switches is not None)
            near, half, square = reaches(dt, (tuning[STRONGEST] if finding > 0.0 else switching) * per_inertia)
            near_held, half_held, square_held = reaches(dt, 2.0 * chosen_for * per_inertia / (delay + dt))
            counted, late_ns = dt, int(1e9 * (delay + 0.5 * half_steps * dt) + 0.5)
        delay_ns[k], error = late_ns, observed - omega
        if given is None:
            away = (measured - seen - dt * omega + left) - pull
            left, pull, change = differentiate(away, per_dt, near, half, square)
            seen, omega = measured, omega + change
        else:
            omega = given[k]
        if waits:
            # A sign held over the gap would pass for a torque: the filter waits, and sliding goes on where it was.
            observed = omega + error
        else:
            observed, integral, torque = _hold(
                switches,
                twists,
                observed,
                integral,
                error,
                omega,
                known,
                dt,
                per_dt,
                nudge,
                lift,
                switching,
                near_held,
                half_held,
                square_held,
            )
            first, second, third = filtered(torque, first, second, third, share, last_share)
            age += share
        before, (velocity[k], friction[k]) = i, (omega, third) if age >= SETTLING else (np.nan, np.nan)
    # fmt: off
    (
        s[_SEEN], s[_LEFT], s[_PULL], s[_VELOCITY], s[_OBSERVED], s[_INTEGRAL], s[_FIRST], s[_SECOND], s[_THIRD],
        s[_AGE], s[_CURRENT], s[_STEP], s[_RUNNING], s[_BOUND], s[_CHOSEN_FOR], s[_FINDING],
        whole[_LAST_NS], whole[_DELAY_NS],
    ) = (
        seen, left, pull, omega, observed, integral, first, second, third,
        age, before, step, runs, bound, chosen_for, finding,
        last, late_ns,
    )
    # fmt: on


@njit(cache=True, error_model="numpy", forceinline=True)
def _is_missing(given: Float64 | None, k: int) -> bool:
    """Return whether a measured velocity was to be there and is not."""
    return False if given is None else not math.isfinite(given[k])
