"""Second-order sliding mode from the angle alone (Davila, Fridman and Levant 2005)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from etb_hil.observer.angle_alone import DELAY_NS, LAST_NS, AngleAlone
from etb_hil.observer.differentiator import differentiate, reach
from etb_hil.observer.estimate import SensorNoise
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

_SEEN, _LEFT, _PULL, _WAY, _UNIT, _RATE, _FIRST, _SECOND, _THIRD, _AGE, _CURRENT, _STEP = range(12)
_RUNNING, _BOUND, _CHOSEN_FOR, _FINDING = 12, 13, 14, 15
_STATES = 16


class SecondOrderSlidingModeObserver(AngleAlone):
    """Observes angle and velocity; friction is what the switching adds to the known acceleration, low-pass filtered.

    `switching_torque` of the settings bounds the friction. Discretised implicitly: no chattering about an exact signal.
    Noise of the angle passes as J / step^2, up to the bound.
    """

    def __init__(
        self, throttle: ThrottleParameters, noise: SensorNoise, settings: SlidingModeSettings | None = None
    ) -> None:
        super().__init__(_observe, throttle, tuning_of(throttle, noise, settings), _STATES)


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
    torque_per_ampere, per_inertia, values = p[TORQUE_PER_AMPERE], 1.0 / p[INERTIA], registers(p)
    counted = kept = lowest = highest = share = last_share = per_unit = nudge = gain = 0.0
    # What every sample needs stays out of memory: as elements of `s`, they would be stored and loaded sample by sample.
    seen, left, pull, way, unit, rate = s[_SEEN], s[_LEFT], s[_PULL], s[_WAY], s[_UNIT], s[_RATE]
    first, second, third, age = s[_FIRST], s[_SECOND], s[_THIRD], s[_AGE]
    before, step, runs, bound, chosen_for = s[_CURRENT], s[_STEP], s[_RUNNING], s[_BOUND], s[_CHOSEN_FOR]
    least, finding, last, late_ns = tuning[LEAST_BOUND], s[_FINDING], whole[LAST_NS], whole[DELAY_NS]
    for k in range(len(time_ns)):
        i, measured = current[k], angle[k]
        velocity[k] = friction[k] = np.nan
        delay_ns[k] = late_ns
        if not math.isfinite(i + measured):
            continue
        step_ns = time_ns[k] - last
        last = time_ns[k]
        if runs == 0.0 or step_ns > LONGEST_GAP_NS or step_ns <= 0:
            way = first = second = third = age = step = left = pull = counted = 0.0
            seen, before, runs, finding = measured, i, 1.0, tuning[FINDING_S]
            continue
        dt = step_ns * 1e-9
        known = torque_per_ampere * 0.5 * (i + before) - spring_torque(measured, values)
        if dt != counted:  # divisions are dear, and the step hardly ever changes
            kept = keep(dt)
        is_late = dt > LATE * step and step > 0.0
        if is_late or finding > 0.0:
            finding, counted = max(finding, dt) if is_late else finding - dt, 0.0
        bound = max(bound * kept, abs(known), least)
        if dt != counted or bound < lowest or bound > highest:
            chosen_for = followed(bound, chosen_for)
            lowest, highest = FOLLOWED * chosen_for, chosen_for / FOLLOWED
            switching, delay, share, last_share = gains_of(dt, chosen_for, tuning, True, False)
            # What is in units of the reach is the same in those of the new one, to the bit where it has not changed.
            last_unit, last_rate = unit, rate
            unit = reach(dt, (tuning[STRONGEST] if finding > 0.0 else switching) * per_inertia)
            per_unit, rate = 1.0 / unit, unit / dt
            left, pull, way = left * (last_unit / unit), pull * (last_unit / unit), way * (last_rate / rate)
            nudge = dt * per_inertia / rate
            gain = share / nudge
            delay_ns[k] = late_ns = int(1e9 * (delay + dt) + 0.5)
            counted = dt
        way += nudge * known
        left, pull, change = differentiate(((measured - seen) * per_unit + left - way) - pull)
        if finding <= 0.0:
            first, second, third = filtered(-change * gain, first, second, third, share, last_share)
            age += share
        seen, way = measured, way + change
        before, step = i, dt
        if age >= SETTLING:
            velocity[k], friction[k] = way * rate, third
    s[_SEEN], s[_LEFT], s[_PULL], s[_WAY], s[_UNIT], s[_RATE] = seen, left, pull, way, unit, rate
    s[_FIRST], s[_SECOND], s[_THIRD], s[_AGE] = first, second, third, age
    s[_CURRENT], s[_STEP], s[_RUNNING], s[_BOUND], s[_CHOSEN_FOR] = before, step, runs, bound, chosen_for
    s[_FINDING], whole[LAST_NS], whole[DELAY_NS] = finding, last, late_ns
