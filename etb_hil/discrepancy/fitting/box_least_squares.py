"""Least squares inside a box on normal equations: projected Newton, active set."""

from __future__ import annotations

import numpy as np

from etb_hil.recording.samples import Float64

_ITERATIONS = 200


def box_least_squares(normal: Float64, right: Float64, low: Float64, high: Float64) -> Float64:
    """Return x (n) that minimises x' A x / 2 - b' x with low <= x <= high.

    `normal` A (n, n) is positive definite, `right` b (n). The box need not contain 0.
    """
    x = np.clip(np.zeros(len(right)), low, high)
    free = np.ones(len(right), bool)
    for _ in range(_ITERATIONS):
        target = x.copy()
        if free.any():
            rest = right[free] - normal[np.ix_(free, ~free)] @ x[~free]
            target[free] = np.linalg.solve(normal[np.ix_(free, free)], rest)
        step = target - x
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(step > 0.0, (high - x) / step, np.where(step < 0.0, (low - x) / step, np.inf))
        ratio[~free] = np.inf
        reach = float(ratio.min(initial=np.inf))
        if reach < 1.0:
            hit = int(np.argmin(ratio))
            x = x + max(reach, 0.0) * step
            x[hit] = high[hit] if step[hit] > 0.0 else low[hit]
            free[hit] = False
            continue
        x = target
        slope = normal @ x - right  # a bound holds only what pushes against it
        scale = 1e-9 * (np.abs(right) + np.abs(normal) @ np.abs(x)) + 1e-300
        wrong = ~free & (high > low) & np.where(x >= high, slope > scale, slope < -scale)
        if not wrong.any():
            break
        free[int(np.argmax(np.where(wrong, np.abs(slope) / scale, 0.0)))] = True
    return x
