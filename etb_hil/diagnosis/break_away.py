"""Break-away: what it takes to set a resting plate going slowly, rest by rest, and what the time of rest does to it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.ticks import TICK, Ticks
from etb_hil.plant.exactmath import log
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.recording.samples import Float64

READING = 0.015  # share by which a filtered, noisy peak may be read wrong: what simulated units have shown

_STILL = 0.03  # rad/s
_REST = 100  # ticks that a plate must rest for
_FLICKER = 20  # ticks for which an estimate may say otherwise
_RESTED = 0.012  # rad: as far as bristles give way
_MOVED = 0.04  # rad: far beyond presliding
_LONGEST = 1000  # ticks from rest to having moved that far
_SLOW = 0.3  # rad/s: a faster start is no ramp of the torque
_MEAN = 10  # ticks that a peak is the mean of: noise has peaks of its own
_CLEAR = 0.02  # rad from limp-home and the stops, whose torque jumps
_RISE = (0.2, 0.8)  # shares of the climb to a peak between which its rate is taken
_FEWEST = 2  # a direction
_SPREAD = 3.0  # the longest rest over the shortest from which a law can be read
_DECADE = 2.302585092994046


@dataclass(frozen=True, slots=True)
class BreakAway:
    """One break-away: `torque` N·m in the `direction` (1 opening, -1 closing), after `rest` s, at `angle` rad.

    `rate` N·m/s is how fast friction rose to it, NaN where it stood there before.
    """

    torque: float
    direction: int
    rest: float
    angle: float
    rate: float


@dataclass(frozen=True, slots=True)
class BreakAwayTorque:
    """The mean of both directions, with its 95 % interval, from `count` break-aways.

    `per_decade` is by what share a ten times longer rest raises it, with its interval; None where the rests are too
    much alike.
    """

    value: float
    low: float
    high: float
    count: int
    per_decade: tuple[float, float, float] | None


def break_aways(ticks: Ticks, throttle: ThrottleParameters) -> list[BreakAway]:
    """Return every break-away of a run by the live estimates, the plate having rested for 0.1 s and moved off slowly.

    Springs are the bench's model's; what they have wrong is even in the direction and leaves a mean over both.
    """
    rests = _rests(ticks.time, ticks.angle, ticks.velocity)
    clear = [(since, left) for since, left in rests if _is_clear(float(ticks.angle[since]), throttle)]
    return [one for since, left in clear if (one := _followed(ticks, since, left)) is not None]


@njit(cache=True, error_model="numpy")
def _rests(time: Float64, angle: Float64, velocity: Float64) -> list[tuple[int, int]]:
    """Return from which tick to which one the plate rested, each time that it moved off again."""
    found = [(0, 0)]
    since = flicker = 0
    for k in range(1, len(time)):
        if not abs(time[k] - time[k - 1] - TICK) < 0.5 * TICK or math.isnan(velocity[k]):
            since, flicker = k, 0
        elif abs(velocity[k]) < _STILL and abs(angle[k] - angle[since]) < _RESTED:
            flicker = 0
        else:
            flicker += 1
            if flicker < _FLICKER and abs(angle[k] - angle[since]) < _RESTED:
                continue
            left = k - flicker + 1
            if left - since >= _REST:
                found.append((since, left))
            since, flicker = k, 0
    return found[1:]


def break_away_torque(
    found: Sequence[BreakAway], grown: Callable[[float], float] | None = None
) -> BreakAwayTorque | None:
    """Return what several break-aways say together; None where a direction has fewer than two.

    `grown` is a known law of rest: the factor on T_st after so many s. Then the mean is that at its factor 1.
    """
    by_way = [
        [one.torque / (1.0 if grown is None else grown(one.rest)) for one in found if one.direction == way]
        for way in (1, -1)
    ]
    if min(len(torques) for torques in by_way) < _FEWEST:
        return None
    value, variance = 0.0, 0.0
    for torques in by_way:
        mean = sum(torques) / len(torques)
        square = sum((torque - mean) * (torque - mean) for torque in torques) / (len(torques) - 1)
        value += 0.5 * mean
        variance += 0.25 * square / len(torques)
    free = len(found) - 2
    reach = TWO_SIDED_95 * (1.0 + 1.2 / free + 1.1 / (free * free)) * math.sqrt(variance)  # Student's factor within 8 %
    return BreakAwayTorque(value, value - reach, value + reach, len(found), _per_decade(found, value))


def _per_decade(found: Sequence[BreakAway], level: float) -> tuple[float, float, float] | None:
    """Return the slope of torque over the logarithm of the rest, each direction about its own mean."""
    rests = [one.rest for one in found]
    if max(rests) < _SPREAD * min(rests):
        return None
    xs, ys = [], []
    for way in (1, -1):
        same = [one for one in found if one.direction == way]
        decades = [float(log(one.rest)) / _DECADE for one in same]
        middle, mean = sum(decades) / len(same), sum(one.torque for one in same) / len(same)
        xs += [x - middle for x in decades]
        ys += [one.torque - mean for one in same]
    square = sum(x * x for x in xs)
    free = len(found) - 3
    if free < 1 or square <= 0.0:
        return None
    slope = sum(x * y for x, y in zip(xs, ys, strict=True)) / square
    left = sum((y - slope * x) * (y - slope * x) for x, y in zip(xs, ys, strict=True)) / free
    reach = TWO_SIDED_95 * (1.0 + 1.2 / free + 1.1 / (free * free)) * math.sqrt(left / square)
    return slope / level, (slope - reach) / level, (slope + reach) / level


def _is_clear(angle: float, p: ThrottleParameters) -> bool:
    away_from_limp_home = abs(angle - p.limp_home) > _CLEAR
    return away_from_limp_home and p.stop_low + _CLEAR < angle < p.stop_high - _CLEAR


def _followed(ticks: Ticks, rested: int, left: int) -> BreakAway | None:
    """Return the break-away of a plate that rested from one tick to the other; None where it was no slow one."""
    start = float(ticks.angle[left])
    end = left
    while end < min(left + _LONGEST, len(ticks) - 1) and abs(ticks.angle[end] - start) < _MOVED:
        end += 1
    way = float(ticks.angle[end]) - start
    if abs(way) < _MOVED or abs(ticks.velocity[end]) > _SLOW:
        return None
    direction = 1 if way > 0.0 else -1
    along = direction * ticks.friction[rested : end + 1]
    if len(along) <= _MEAN or np.any(np.isnan(along)):
        return None
    means = [float(np.mean(along[k : k + _MEAN])) for k in range(len(along) - _MEAN)]
    least = min(
        range(max(left - rested, 1)), key=means.__getitem__
    )  # before it, the plate may still have been arriving
    top = max(range(least, len(means)), key=means.__getitem__)
    base, climb = means[least], means[top] - means[least]
    low = high = top
    while low > least and means[low] > base + _RISE[0] * climb:
        low -= 1
    while high > low and means[high] > base + _RISE[1] * climb:
        high -= 1
    rate = (means[high] - means[low]) / ((high - low) * TICK) if high > low else math.nan
    return BreakAway(means[top], direction, (left - rested) * TICK, start, rate)
