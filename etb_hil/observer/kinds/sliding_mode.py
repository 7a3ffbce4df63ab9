"""Sliding-mode observers: the seed paper's, and one that does not chatter.

Both are of the velocity equation.

Both observe eq. (3) of the seed paper from current and velocity, and read friction off what holds the observed
velocity to the measured one. The velocity is a measured one where it is given, as in the paper; else a robust
differentiator takes it from the angle. A measured velocity is taken to be exact: state a cut-off where it is not.
"""

from __future__ import annotations

import math

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.observer.differentiator import differentiate, reach
from etb_hil.observer.estimate import FrictionEstimate, SensorNoise
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
from etb_hil.observer.registry import ObserverKind
from etb_hil.plant.parameters import Model, ThrottleParameters
from etb_hil.plant.physics import INERTIA, TORQUE_PER_AMPERE, registers, spring_torque
from etb_hil.recording.samples import Float64, Int64

# Whether the sign switches. None, not False: numba compiles each law apart.
_EXPLICIT, _IMPLICIT = True, None
_SEEN, _LEFT, _PULL, _WAY, _UNIT, _RATE, _VELOCITY, _ERROR, _BOUND, _CHOSEN_FOR = range(10)
_FIRST, _SECOND, _THIRD, _AGE, _BEFORE, _STEP, _RUNNING, _FINDING = range(10, 18)
_STATES = 18
_LAST_NS, _DELAY_NS = 0, 1
_NO_STEP = -(2**62)  # ns: none that ever comes


class _VelocityObserver:
    """What the two sliding-mode observers have in common.

    The common part is all but the law that drives the observed velocity to the measured one.
    """

    _switches: bool | None

    def __init__(
        self, throttle: ThrottleParameters, noise: SensorNoise, settings: SlidingModeSettings | None = None
    ) -> None:
        self._p = throttle.vector()
        self._tuning = tuning_of(throttle, noise, settings)
        self._state = np.zeros(_STATES)
        self._whole = np.zeros(2, np.int64)

    def push(
        self, time_ns: Int64, current: Float64, angle: Float64, measured_velocity: Float64 | None = None
    ) -> FrictionEstimate:
        """Take samples, with the velocity (n) in rad/s where one is measured.

        `Observer.push` gives the details.
        """
        velocity, friction = np.empty(len(time_ns)), np.empty(len(time_ns))
        delay_ns = np.empty(len(time_ns), np.int64)
        _known(current, angle, self._p, friction)  # stays there until a sample's turn comes
        state = (self._p, self._tuning, self._state, self._whole)
        _observe(time_ns, current, angle, measured_velocity, *state, self._switches, velocity, friction, delay_ns)
        return FrictionEstimate(time_ns, velocity, friction, delay_ns)


class SlidingModeObserver(_VelocityObserver):
    """Seed paper, eq. (4) to (6): M sgn through a low-pass filter.

    Without any noise, M sgn leaves a ripple that falls with the step; noise of the velocity passes into the sign and is
    weighed by M, whatever its size.
    """

    _switches = _EXPLICIT


class ImplicitSlidingModeObserver(_VelocityObserver):
    """The same with the sign taken at the end of the step.

    The step is a projection (Acary and Brogliato 2010), and does not chatter.

    Noise of the velocity passes as J / step, up to M.
    """

    _switches = _IMPLICIT


def _of_model(_model: Model, throttle: ThrottleParameters, noise: SensorNoise) -> SlidingModeObserver:
    return SlidingModeObserver(throttle, noise)


OBSERVER = ObserverKind("the seed paper's sliding-mode observer, eq. (4) to (6)", _of_model)


@njit(cache=True, error_model="numpy", forceinline=True)
def _hold(switches: bool | None, error: float, free: float, strongest: float) -> tuple[float, float]:
    """Return the observed velocity's error after a step, and what was taken off.

    `error` was there at the step's beginning, `free` is there at its end if nothing is taken off; at most `strongest`
    is. All are in one unit, whichever.
    """
    if switches is None:
        held = min(max(free, -strongest), strongest)
    else:
        held = math.copysign(strongest, error) if error != 0.0 else 0.0
    return free - held, held


@njit(cache=True, error_model="numpy")
def _known(current: Float64, angle: Float64, p: Float64, torque: Float64) -> None:
    """Fill in half the motor's torque less the springs', in N·m.

    This pass waits for no other sample, so that several are done at a time.
    """
    half_per_ampere, values = 0.5 * p[TORQUE_PER_AMPERE], registers(p)
    for k in range(len(angle)):
        torque[k] = half_per_ampere * current[k] - spring_torque(angle[k], values)


@njit(cache=True, error_model="numpy")
def _choose(
    bound: float, s: Float64, p: Float64, tuning: Float64, given: Float64 | None, switches: bool | None
) -> tuple[float, ...]:
    """Choose gains for a bound in N·m and for the step; return what hangs on them.

    They are the delay in ns; the filter's shares, and what it takes of the velocity that holds; the velocity that a
    torque of 1 N·m gives in a step, and the one that M gives; the units of velocities in rad/s and of angles in 1/rad;
    how many of the new units the former ones are, of angles and velocities: one, to the bit, where they have not
    changed.
    """
    s[_CHOSEN_FOR] = followed(bound, s[_CHOSEN_FOR])
    dt, chosen_for, per_inertia = s[_STEP], s[_CHOSEN_FOR], 1.0 / p[INERTIA]
    switching, delay, share, last_share = gains_of(dt, chosen_for, tuning, given is None, switches is not None)
    half_steps = (2.0 if given is None else 1.0) + (0.0 if switches is None else 1.0)
    unit = reach(dt, (tuning[STRONGEST] if s[_FINDING] > 0.0 else switching) * per_inertia)
    rate = unit / dt if given is None else 1.0
    nudge = dt * per_inertia / rate
    late_ns = int(1e9 * (delay + 0.5 * half_steps * dt) + 0.5)
    angles, velocities = s[_UNIT] / unit, s[_RATE] / rate
    s[_UNIT], s[_RATE] = unit, rate
    # fmt: off
    return (
        late_ns, share, last_share, share / nudge, nudge, nudge * switching, rate, 1.0 / unit, angles, velocities,
    )
    # fmt: on


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
    velocity: Float64,
    friction: Float64,
    delay_ns: Int64,
) -> None:
    half_per_ampere = 0.5 * p[TORQUE_PER_AMPERE]
    kept = lowest = highest = share = last_share = gain = nudge = strongest = 0.0
    rate = per_unit = 0.0
    # What every sample needs stays out of memory: as elements of `s`, they would be stored and loaded sample by sample.
    # The rest stays there, and leaves them the registers. The residual and pulls is in units of the differentiator's
    # reach, the way of a step and the observed velocity's error in those of a reach a step, `rate` rad/s.
    seen, left, pull, way, omega = s[_SEEN], s[_LEFT], s[_PULL], s[_WAY], s[_VELOCITY]
    error, bound, before = s[_ERROR], s[_BOUND], s[_BEFORE]
    first, second, third, age = s[_FIRST], s[_SECOND], s[_THIRD], s[_AGE]
    least, last, late_ns = tuning[LEAST_BOUND], whole[_LAST_NS], whole[_DELAY_NS]
    stepped, waits = _NO_STEP, False
    for k in range(len(time_ns)):
        measured, known = angle[k], friction[k] + before
        if not math.isfinite(known) or _is_missing(given, k):
            velocity[k], friction[k], delay_ns[k] = np.nan, np.nan, late_ns
            continue
        step_ns, last = time_ns[k] - last, time_ns[k]
        if step_ns != stepped:  # the step hardly ever changes, and what hangs on it is dear
            if s[_RUNNING] == 0.0 or step_ns > LONGEST_GAP_NS or step_ns <= 0:
                omega = 0.0 if given is None else given[k]
                left = pull = way = error = first = second = third = age = s[_STEP] = 0.0
                seen, before, stepped, s[_RUNNING] = measured, half_per_ampere * current[k], _NO_STEP, 1.0
                s[_FINDING] = tuning[FINDING_S] if given is None else 0.0
                velocity[k], friction[k], delay_ns[k] = np.nan, np.nan, late_ns
                continue
            dt = step_ns * 1e-9
            is_late = dt > LATE * s[_STEP] and s[_STEP] > 0.0
            if given is None and (is_late or s[_FINDING] > 0.0):
                s[_FINDING] = max(s[_FINDING], dt) if is_late else s[_FINDING] - dt
            waits = is_late or s[_FINDING] > 0.0
            stepped, s[_STEP], kept, highest = _NO_STEP if waits else step_ns, dt, keep(dt), 0.0
        bound = max(bound * kept, abs(known), least)
        if bound < lowest or bound > highest:
            # fmt: off
            (
                late_ns, share, last_share, gain, nudge, strongest, rate, per_unit, angles, velocities,
            ) = _choose(bound, s, p, tuning, given, switches)
            left, pull, way, error = left * angles, pull * angles, way * velocities, error * velocities
            # fmt: on
            lowest, highest = FOLLOWED * s[_CHOSEN_FOR], s[_CHOSEN_FOR] / FOLLOWED
        if given is None:
            left, pull, change = differentiate(((measured - seen) * per_unit + left - way) - pull)
            seen, way = measured, way + change
            omega = way * rate
        else:
            change, omega = given[k] - omega, given[k]
        if not waits:  # a sign held over the gap would pass for a torque: sliding goes on where it was
            free = error + (nudge * known - change)
            error, held = _hold(switches, error, free, strongest)
            first, second, third = filtered(gain * held, first, second, third, share, last_share)
        before, velocity[k], friction[k], delay_ns[k] = half_per_ampere * current[k], omega, third, late_ns
        if age < SETTLING:
            age += 0.0 if waits else share
            velocity[k], friction[k] = (np.nan, np.nan) if age < SETTLING else (omega, third)
    s[_SEEN], s[_LEFT], s[_PULL], s[_WAY], s[_VELOCITY] = seen, left, pull, way, omega
    s[_ERROR], s[_BOUND], s[_BEFORE] = error, bound, before
    s[_FIRST], s[_SECOND], s[_THIRD], s[_AGE] = first, second, third, age
    whole[_LAST_NS], whole[_DELAY_NS] = last, late_ns


@njit(cache=True, error_model="numpy", forceinline=True)
def _is_missing(given: Float64 | None, k: int) -> bool:
    """Return whether a measured velocity was to be there and is not."""
    return False if given is None else not math.isfinite(given[k])
