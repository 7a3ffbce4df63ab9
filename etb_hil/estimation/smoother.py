"""The smoother of states by Bryson and Frazier (1963), as Bierman (1973) has it.

Compiled. It works on what a filter kept, and goes back by the transposed matrices by which the filter's errors fade:
its own fade too. That of Rauch, Tung and Striebel goes back by inverted ones: where no angle is read, its rounding
errors grow as fast as bristles relax.
"""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.copying import copy_into
from etb_hil.estimation.kalman import LARGE, READINGS, ROUNDING
from etb_hil.estimation.throttle import CURRENT, OMEGA, THETA, VOLTAGE
from etb_hil.recording.samples import Float64


@njit(cache=True, error_model="numpy")
def smooth(
    states: Float64, covariances: Float64, moves: Float64, slopes: Float64, gains: Float64, whitened: Float64,
    roots: Float64,
) -> None:  # fmt: skip
    """Turn filtered states into smoothed ones, in place.

    States are (n, s), their covariances (n, s, s); what the filter kept: see `kalman.run`.
    """
    size = states.shape[1]
    slope, before = np.zeros(size), np.zeros(size)  # of the log-likelihood of all later readings, by the state
    for k in range(len(states) - 1, -1, -1):
        for i in range(size):
            for j in range(size):
                states[k, i] += covariances[k, i, j] * slope[j]
        for m in range(READINGS - 1, -1, -1):
            _back_over_reading(slopes[k, m], gains[k, m], whitened[k, m], roots[k, m], m, slope)
        if k > 0:
            _back_over_motion(moves[k - 1], slope, before)


@njit(cache=True, error_model="numpy")
def _back_over_motion(move: Float64, slope: Float64, before: Float64) -> None:
    """Carry the slope back to the state before a prediction, in place.

    `before` is room. Where the state began afresh, nothing is carried, not even what is no number.
    """
    has_begun = not move.any()
    for i in range(len(slope)):
        before[i] = 0.0
        for j in range(len(slope)):
            before[i] += 0.0 if has_begun else move[j, i] * slope[j]
    copy_into(slope, 0, before)


@njit(cache=True, error_model="numpy")
def _back_over_reading(slopes: Float64, gain: Float64, whitened: float, root: float, m: int, slope: Float64) -> None:
    """Add what a reading says to the slope, in place.

    A reading that there is not, or that moved nothing, has no gain.
    """
    weight = min(LARGE * LARGE / (whitened * whitened), 1.0) if whitened != 0.0 else 1.0
    is_taken, pushes = False, 0.0
    for i in range(len(slope)):
        is_taken = is_taken or gain[i] != 0.0
        pushes += gain[i] / weight * slope[i]
    if not is_taken:
        return
    share = whitened * root - pushes
    slope[CURRENT if m == 0 else THETA] += slopes[0] * share
    slope[OMEGA] += slopes[1] * share
    slope[VOLTAGE] += slopes[2] * share
    if m == 1:
        slope[ROUNDING] += share
