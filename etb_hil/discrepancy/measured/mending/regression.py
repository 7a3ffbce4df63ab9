"""Least squares by most of the samples: a few that are far off are spikes, and bend nothing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]

_PASSES = 3
_NEARLY_ALL = 0.999
_FARTHER = 3.0  # times what all but a few samples are off by


class Fitted(NamedTuple):
    """The numbers (k) that take columns to values, and from where on a sample is far off."""

    numbers: Float64
    far: float


def by_most_rows(columns: Float64, values: Float64, least: float, noise: Float64 | None = None) -> Fitted:
    """Return what takes columns (n, k) to values (n) where these are not far off.

    `least`: what no sample is far off by, in the values' unit. `noise`: the covariance (k, k) of the columns' own
    noise, without which their numbers would come out too small (Fuller 1987).
    """
    counts = np.ones(len(values), np.bool_)
    found: Float64 = np.zeros(columns.shape[1])
    far = least
    for _ in range(_PASSES):
        inside = columns[counts]
        squares = inside.T @ inside
        if noise is not None:
            squares -= noise * len(inside)
        found = np.asarray(np.linalg.lstsq(squares, inside.T @ values[counts], rcond=None)[0], np.float64)
        off = np.abs(values - columns @ found)
        far = max(least, _FARTHER * float(np.quantile(off, _NEARLY_ALL)))
        counts = off < far
    return Fitted(found, far)
