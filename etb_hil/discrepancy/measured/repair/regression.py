"""Robust least squares: a few outliers do not change the fit."""

from __future__ import annotations

import numpy as np

from etb_hil.recording.samples import Float64

_PASSES = 3
_NEARLY_ALL = 0.999
_FARTHER = 3.0  # times what all but a few samples are off by


def robust_least_squares(
    regressors: Float64, values: Float64, least: float, noise: Float64 | None = None
) -> tuple[Float64, float]:
    """Return coefficients (k) of regressors (n, k) for values (n), without outliers.

    The second value is the distance from which on a sample is an outlier.

    `least`: the smallest distance of an outlier, in the values' unit. `noise`: the covariance (k, k) of the regressors'
    own noise, without which the coefficients would be biased towards zero (Fuller 1987).
    """
    counts = np.ones(len(values), np.bool_)
    found: Float64 = np.zeros(regressors.shape[1])
    far = least
    for _ in range(_PASSES):
        inside = regressors[counts]
        squares = inside.T @ inside
        if noise is not None:
            squares -= noise * len(inside)
        found = np.asarray(np.linalg.lstsq(squares, inside.T @ values[counts], rcond=None)[0], np.float64)
        off = np.abs(values - regressors @ found)
        far = max(least, _FARTHER * float(np.quantile(off, _NEARLY_ALL)))
        counts = off < far
    return found, far
