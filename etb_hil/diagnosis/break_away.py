"""Break-away: the torque that sets a resting plate going slowly.

The torque depends on the time of rest before, and on the rate at which the torque rises.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.student import student
from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.interval import Interval
from etb_hil.diagnosis.limit_laws import DECADE
from etb_hil.diagnosis.motion.repeats import error_of_means
from etb_hil.diagnosis.ticks import TICK, Ticks
from etb_hil.plant.exactmath import log
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.recording.samples import Float64

READING = 0.015  # share by which a filtered, noisy peak may be read wrong: benchmarks/break_away_bias.py

_STILL = 5e-4  # rad that a resting plate may move within
_SPAN = 50  # ticks: by the estimated velocity, a coarse sensor's noise would hide that a plate creeps
_REST = 100  # ticks that a plate must rest for
_FLICKER = 20  # ticks for which an estimate may say otherwise
_RESTED = 0.012  # rad: as far as bristles give way
_MOVED = 0.04  # rad: beyond presliding
_SLID = 0.07  # rad: bristles that bend by 10 mrad, a sticky unit's, keep 3 % of their way after 0.04, 0.2 % after this
_LONGEST = 4000  # ticks from rest to having moved that far
_SLOW = 0.3  # rad/s: a faster start is not judged as a torque ramp; the fastest in scenarios/break_away.yaml has 0.25
_RAMP = 50  # ticks: a torque that rose for as long was a slow ramp, however fast the plate then started
_MEAN = 10  # ticks that a peak is the mean of: noise has peaks of its own
_CLEAR = 0.02  # rad from limp-home and the stops, whose torque jumps
_RISE = (0.5, 0.9)  # shares of a peak between which its rate is taken
_LEAST_RISE = 0.2  # share of the climb to it that lies below, where friction stood higher than the half of it
_APART = 1.4  # ramps whose rates differ by less are of one kind
_FEWEST = 2  # a direction
_SPREAD = 3.0  # the longest rest over the shortest from which a law can be read


@dataclass(frozen=True, slots=True)
class BreakAway:
    """One break-away: `torque` N·m in a `direction` (1 opening, -1 closing).

    The break-away came after `rest` s, at `angle` rad. `rate` N·m/s is how fast friction rose to it from where it stood
    at rest, NaN where it stood that high already. `speed` rad/s is the mean one until the plate was clear of its rest.
    """

    torque: float
    direction: int
    rest: float
    angle: float
    rate: float
    speed: float


@dataclass(frozen=True, slots=True)
class BreakAwayTorque:
    """The mean break-away friction of both directions, with its 95 % interval.

    The mean is in N·m, from `count` break-aways. `per_decade` is by what share a ten times longer rest raises it,
    `per_rate` a ten times quicker ramp, with their intervals; None where the rests, or the rates, are too close
    together.
    """

    value: float
    low: float
    high: float
    count: int
    per_decade: tuple[float, float, float] | None
    per_rate: tuple[float, float, float] | None

    @property
    def read(self) -> Interval:
        """The mean with the error of reading a peak in its interval."""
        reading = READING * self.value
        return Interval(self.value, self.low - reading, self.high + reading)


def break_aways(ticks: Ticks, throttle: ThrottleParameters) -> list[BreakAway]:
    """Return every break-away of a run, by the friction at its ticks.

    The plate had rested for 0.1 s and moved off slowly. What springs have wrong in that friction is even in the
    direction and cancels in a mean over both.
    """
    found, gone = [], 0
    for since, left in _rests(ticks.time, ticks.angle, ticks.velocity):
        if since < gone or not _is_clear(float(ticks.angle[since]), throttle):
            continue  # a plate that stops before it is clear of its rest has not broken away anew
        end = _moved(ticks, left)
        if end is not None and (one := _followed(ticks, since, left, end)) is not None:
            found.append(one)
            gone = end
    return found


@njit(cache=True, error_model="numpy")
def _rests(time: Float64, angle: Float64, velocity: Float64) -> list[tuple[int, int]]:
    """Return the rests of the plate: the tick where each began, and where it ended.

    Only those rests count after which the plate moved off again.
    """
    found = [(0, 0)]
    since, flicker, known = -1, 0, 0
    for k in range(1, len(time)):
        if not abs(time[k] - time[k - 1] - TICK) < 0.5 * TICK or math.isnan(velocity[k]):
            since, flicker, known = -1, 0, k
            continue
        is_still = k - known >= _SPAN and abs(angle[k] - angle[k - _SPAN]) < _STILL
        if since < 0:
            since = k - _SPAN if is_still else -1
            continue
        if is_still and abs(angle[k] - angle[since]) < _RESTED:
            flicker = 0
            continue
        flicker += 1
        if flicker < _FLICKER and abs(angle[k] - angle[since]) < _RESTED:
            continue
        left = k - flicker + 1
        if left - since >= _REST:
            found.append((since, left))
        since, flicker = -1, 0
    return found[1:]


def break_away_torque(
    found: Sequence[BreakAway], grown: Callable[[float], float] | None = None
) -> BreakAwayTorque | None:
    """Return what several break-aways say together.

    None where a direction has fewer than two. `grown` is a known law of rest: the factor on T_st after so many s. Then
    the mean is that at its factor 1.
    """
    by_way = [
        [one.torque / (1.0 if grown is None else grown(one.rest)) for one in found if one.direction == way]
        for way in (1, -1)
    ]
    if min(len(torques) for torques in by_way) < _FEWEST:
        return None
    value = 0.5 * sum(sum(torques) / len(torques) for torques in by_way)
    reach = 0.5 * TWO_SIDED_95 * error_of_means(by_way)
    rated = [one for one in found if one.rate > 0.0]
    rates = [one.rate for one in rated]
    return BreakAwayTorque(
        value, value - reach, value + reach, len(found),
        _per_decade(found, [one.rest for one in found], value), _per_decade(rated, rates, value),
    )  # fmt: skip


def at_rates(
    found: Sequence[BreakAway], grown: Callable[[float], float] | None = None
) -> list[tuple[float, BreakAwayTorque]]:
    """Return what the break-aways say together, at each of several rates.

    Each entry has its rate in N·m/s; slow ones come first. The list is empty where all ramps were equal. `grown` is as
    for `break_away_torque`.
    """
    groups: list[list[BreakAway]] = []
    for one in sorted((one for one in found if one.rate > 0.0), key=lambda one: one.rate):
        if groups and one.rate < _APART * groups[-1][-1].rate:
            groups[-1].append(one)
        else:
            groups.append([one])
    told = [(group[len(group) // 2].rate, break_away_torque(group, grown)) for group in groups]
    several = [(rate, torque) for rate, torque in told if torque is not None]
    return several if len(several) > 1 else []


def _per_decade(found: Sequence[BreakAway], of: Sequence[float], level: float) -> tuple[float, float, float] | None:
    """Return the slope of torque over the logarithm of rests or rates.

    The slope is taken for each direction about its own mean, as a share of `level` for a decade, with its 95 %
    interval. None where the data do not tell it.
    """
    if not of or max(of) < _SPREAD * min(of):
        return None
    xs, ys = [], []
    for way in (1, -1):
        same = [(one, value) for one, value in zip(found, of, strict=True) if one.direction == way]
        if not same:
            return None
        decades = [float(log(value)) / DECADE for _, value in same]
        middle, mean = sum(decades) / len(same), sum(one.torque for one, _ in same) / len(same)
        xs += [x - middle for x in decades]
        ys += [one.torque - mean for one, _ in same]
    square = sum(x * x for x in xs)
    free = len(found) - 3
    if free < 1 or square <= 0.0:
        return None
    slope = sum(x * y for x, y in zip(xs, ys, strict=True)) / square
    left = sum((y - slope * x) * (y - slope * x) for x, y in zip(xs, ys, strict=True)) / free
    reach = float(student(free)) * math.sqrt(left / square)
    return slope / level, (slope - reach) / level, (slope + reach) / level


def _is_clear(angle: float, p: ThrottleParameters) -> bool:
    away_from_limp_home = abs(angle - p.limp_home) > _CLEAR
    return away_from_limp_home and p.stop_low + _CLEAR < angle < p.stop_high - _CLEAR


def _moved(ticks: Ticks, left: int) -> int | None:
    """Return the tick at which a plate that left its rest is clear of it.

    The plate left its rest at the tick `left`. None where it never is clear of it.
    """
    start = float(ticks.angle[left])
    for k in range(left, min(left + _LONGEST, len(ticks))):
        if abs(ticks.angle[k] - start) >= _MOVED:
            return k
    return None


def _slid(ticks: Ticks, left: int, end: int) -> int:
    """Return the tick up to which a plate slides on, slowly and the same way.

    The plate left its rest at the tick `left` and is clear of it at the tick `end`.
    """
    start, last = float(ticks.angle[left]), end
    way = 1.0 if ticks.angle[end] > start else -1.0
    for k in range(end + 1, min(left + _LONGEST, len(ticks))):
        is_still = abs(ticks.angle[k] - ticks.angle[k - _SPAN]) < _STILL
        if is_still or abs(ticks.velocity[k]) > _SLOW or not _MOVED <= way * (ticks.angle[k] - start) < _SLID:
            break
        last = k
    return last


def _followed(ticks: Ticks, rested: int, left: int, end: int) -> BreakAway | None:
    """Return the break-away of a plate, from the ticks of its rest and its motion.

    The plate rested from the tick `rested` to `left`, and is clear of its rest at `end`. None where it moved off at
    once, under no slow ramp of the torque.
    """
    start = float(ticks.angle[left])
    direction = 1 if ticks.angle[end] > start else -1
    along = direction * ticks.friction[rested : _slid(ticks, left, end) + 1]
    if len(along) <= _MEAN or np.any(np.isnan(along)):
        return None
    means: list[float] = np.lib.stride_tricks.sliding_window_view(along[:-1], _MEAN).mean(axis=1).tolist()
    rest = max(left - rested, 1)
    least = min(
        range(min(rest, len(means))), key=means.__getitem__
    )  # before it, the plate may still have been arriving
    top = max(range(least, len(means)), key=means.__getitem__)
    base = sorted(means[:rest])[rest // 2]
    begun = max(_RISE[0] * means[top], base + _LEAST_RISE * (means[top] - base))
    low = high = top
    while low > least and means[low] > begun:
        low -= 1
    while high > low and means[high] > _RISE[1] * means[top]:
        high -= 1
    if abs(ticks.velocity[end]) > _SLOW and high - low < _RAMP:
        return None
    rate = (means[high] - means[low]) / ((high - low) * TICK) if high > low else math.nan
    speed = abs(float(ticks.angle[end]) - start) / ((end - left) * TICK)
    return BreakAway(means[top], direction, rest * TICK, start, rate, speed)
