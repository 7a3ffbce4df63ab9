"""Tolerance limits: below what nearly all of a population lies, as far as a sample of it tells."""

from __future__ import annotations

import numpy as np

from etb_hil.recording.samples import Float64

FEWEST = 8  # values, of which a scatter is known at all
_CONTENT, _CONFIDENCE = 2.3263, 1.6449  # normal quantiles of 99 and 95 %


def factor(count: int) -> float:
    """Return the one-sided tolerance factor of a normal distribution (Natrella 1963).

    So many standard deviations above the mean of `count` values lie less than 1 % of their like, with 95 % confidence.
    """
    a = 1.0 - _CONFIDENCE**2 / (2.0 * (count - 1.0))
    b = _CONTENT**2 - _CONFIDENCE**2 / count
    return float((_CONTENT + np.sqrt(_CONTENT**2 - a * b)) / a)


def tolerance_limit(values: Float64) -> float | None:
    """Return what less than 1 % of the like of values (n), above zero, exceed, with 95 % confidence.

    Their logarithms are taken for normally distributed: friction scatters by shares. None of fewer than 8 values.
    """
    if len(values) < FEWEST or not np.all(values > 0.0):
        return None
    level = np.log(values)
    return float(np.exp(level.mean() + factor(len(level)) * level.std(ddof=1)))
