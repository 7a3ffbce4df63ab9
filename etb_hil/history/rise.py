"""A unit against its own baseline: friction that has risen since the unit was first measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.history.temperature import LEAST_SPREAD
from etb_hil.recording.samples import Float64

SMALLEST = 0.25  # share: the smallest rise that matters
FEWEST = 8  # units, from which their scatter is known at all
_CONTENT, _CONFIDENCE = 2.3263, 1.6449  # normal quantiles of 99 and 95 %
_TO_SIGMA = 1.4826  # of a median distance from the median


@dataclass(frozen=True, slots=True)
class Rise:
    """A unit whose latest run lies `rise` (share) above its first, which began at `since`, ISO 8601."""

    unit: str
    rise: float
    since: str


@dataclass(frozen=True, slots=True)
class Rises:
    """What `looked_at` units say that were measured again: those above `limit`, a share."""

    looked_at: int
    limit: float
    found: list[Rise]


def factor(count: int) -> float:
    """Return the one-sided tolerance factor of a normal distribution (Natrella 1963).

    So many standard deviations above the mean of `count` values lie less than 1 % of their like, with 95 % confidence.
    """
    a = 1.0 - _CONFIDENCE**2 / (2.0 * (count - 1.0))
    b = _CONTENT**2 - _CONFIDENCE**2 / count
    return float((_CONTENT + np.sqrt(_CONTENT**2 - a * b)) / a)


def alarm(limit: float, smallest: float = SMALLEST) -> float:
    """Return the logarithm of now over then from which on a unit has risen.

    `limit` of the scatter of healthy units. Where that lies under half the way to the smallest rise that matters, half
    the way it is: healthy and risen units are then told apart with equal risk, and a scatter that was found too small
    by chance raises no alarm over what does not matter.
    """
    return max(limit, 0.5 * math.log1p(smallest))


def rises(
    started: Sequence[str], compared: Float64, temperature: Float64, units: Sequence[str], *, is_at_one: bool
) -> Rises | None:
    """Return the units that have risen, of values (n) in order of time; None where no unit was measured again.

    `compared` without temperature where `is_at_one` says that it could be taken out; otherwise only runs of a unit that
    lie within 5 K (`temperature` (n) in degC) are held against each other.
    """
    first: dict[str, int] = {}
    last: dict[str, int] = {}
    for k, unit in enumerate(units):
        if not (math.isfinite(compared[k]) and compared[k] > 0.0):
            continue
        since = first.setdefault(unit, k)
        if k != since and (is_at_one or abs(temperature[k] - temperature[since]) <= LEAST_SPREAD):
            last[unit] = k
    if not last:
        return None
    ratio = {unit: math.log(compared[k] / compared[first[unit]]) for unit, k in last.items()}
    level = alarm(_scatter(np.array(list(ratio.values()))))
    found = [Rise(unit, math.expm1(r), started[first[unit]]) for unit, r in ratio.items() if r > level]
    return Rises(len(ratio), math.expm1(level), found)


def _scatter(ratio: Float64) -> float:
    """Return the limit of healthy units' ratios (n), from their middle half, which risen ones hardly move."""
    if len(ratio) < FEWEST:
        return 0.0
    middle = float(np.median(ratio))
    return middle + factor(len(ratio)) * _TO_SIGMA * float(np.median(np.abs(ratio - middle)))
