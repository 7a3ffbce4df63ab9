"""A mean over repeats with its 95 % interval: bounds of systematic errors, noise, and how well the unit repeats."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from etb_hil.diagnosis.half_width import TWO_SIDED_95, half_width

# Student's t, two-sided 95 %, by degrees of freedom from 1 on.
_STUDENT = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228)


def combined(evens: Sequence[float], normal: float = 0.0) -> float:
    """Return the 95 % half width of a sum of errors.

    Each of `evens` is uniform within its bounds; `normal` is a standard deviation. The widest of `evens` keeps
    its shape, the others join the normal part by their variances (JCGM 100:2008, 4.3.7 and 5.1.2).
    """
    ordered = sorted(evens, reverse=True)
    variance = normal * normal + sum(even * even / 3.0 for even in ordered[1:])
    return half_width(math.sqrt(variance), ordered[0] if ordered else 0.0)


def student(degrees: int) -> float:
    """Return by how much Student's t with so many degrees of freedom is wider than the normal distribution's 1.96."""
    return _STUDENT[min(degrees, len(_STUDENT)) - 1] / TWO_SIDED_95


def error_of_mean(values: Sequence[float]) -> float:
    """Return the standard deviation of a mean, widened so that 1.96 of it are Student's 95 %; 0 of a single value."""
    return error_of_means([values])


def error_of_means(groups: Sequence[Sequence[float]]) -> float:
    """Return the same of a sum of means, one of each group: what repeats scatter by is equal in all groups."""
    degrees = sum(len(values) - 1 for values in groups)
    if degrees < 1:
        return 0.0
    squares = sum(float(np.var(values)) * len(values) for values in groups)
    return math.sqrt(squares / degrees * sum(1.0 / len(values) for values in groups)) * student(degrees)
