"""Tolerance limits: below what nearly all of a population lies.

A sample tells it as far as it can; also what counts as a change.
"""

from __future__ import annotations

import math

import numpy as np

from etb_hil.histories.distribution import LOGNORMAL, Distribution
from etb_hil.recording.samples import Float64

SMALLEST = 0.25  # share: the smallest rise that matters
FEWEST = 8  # values, of which a scatter is known at all
_CONTENT, _CONFIDENCE = 2.3263, 1.6449  # normal quantiles of 99 and 95 %
_TO_SIGMA = 1.4826  # of a median distance from the median


def factor(count: int) -> float:
    """Return the one-sided tolerance factor of a normal distribution (Natrella 1963).

    So many standard deviations above the mean of `count` values lie less than 1 % of such units, with 95 % confidence.
    """
    a = 1.0 - _CONFIDENCE**2 / (2.0 * (count - 1.0))
    b = _CONTENT**2 - _CONFIDENCE**2 / count
    return float((_CONTENT + np.sqrt(_CONTENT**2 - a * b)) / a)


def tolerance_limit(shape: Distribution | None) -> float | None:
    """Return what less than 1 % of units exceed, with 95 % confidence.

    A normal or lognormal one is judged by its tolerance factor, but not below that of the same values with a free
    shape; else by the bootstrap, basic in the logarithm of the distance from the median (Davison and Hinkley 1997).
    None where no distribution is known.
    """
    if shape is None:
        return None
    if not shape.is_normal:
        apart = shape.replicates[:, 2] - shape.replicates[:, 1]
        return shape.median + (shape.most - shape.median) ** 2 / float(np.quantile(apart, 0.05))
    sigmas = factor(shape.count) / 3.0
    if shape.family == LOGNORMAL:
        limit = shape.median * (shape.high / shape.median) ** sigmas
    else:
        limit = shape.median + sigmas * (shape.high - shape.median)
    free = tolerance_limit(shape.free)
    return limit if free is None else max(limit, free)


def change_limit(ratio: Float64) -> float:
    """Return the logarithm of now over then from which on a unit has changed.

    The ratios (n) of many units tell it.

    Below the limit of healthy units' scatter nobody has; it comes from the middle half of them, which changed ones
    hardly move. Where that lies under half the way to the smallest rise that matters, half the way it is: healthy and
    risen units are then distinguished with equal risk, and a scatter that was found too small by chance raises no alarm
    over what does not matter.
    """
    half_way = 0.5 * math.log1p(SMALLEST)
    if len(ratio) < FEWEST:
        return half_way
    middle = float(np.median(ratio))
    return max(middle + factor(len(ratio)) * _TO_SIGMA * float(np.median(np.abs(ratio - middle))), half_way)
