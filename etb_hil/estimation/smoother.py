"""The smoother of Bryson and Frazier (1963), in Bierman's form (1973); compiled.

It works on what a filter kept. It goes back by the transposed matrices by which the filter's errors fade, and so do
its own. That of Rauch, Tung and Striebel goes back by inverted ones: where no angle is read, its rounding errors grow
as fast as bristles relax.
"""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.copying import copy_into, copy_matrix
from etb_hil.estimation.kalman import LARGE, READINGS, ROUNDING
from etb_hil.estimation.throttle import CURRENT, OMEGA, THETA, VOLTAGE
from etb_hil.recording.samples import Float64


@njit(cache=True, error_model="numpy")
def smooth(
    states: Float64,
    covariances: Float64,
    moves: Float64,
    slopes: Float64,
    gains: Float64,
    whitened: Float64,
    roots: Float64,
) -> None:
    """Turn filtered states and covariances into smoothed ones, in place.

    States are (n, s), covariances (n, s, s); what the filter kept: see `kalman.run`.
    """
    size = states.shape[1]
    # Slope and curvature of the log-likelihood of all later readings, by the state.
    slope, bend = np.zeros(size), np.zeros((size, size))
    reads, by_gain, room = np.zeros(size), np.zeros(size), np.zeros((size, size))
    for k in range(len(states) - 1, -1, -1):
        _correct(states[k], covariances[k], slope, bend, room)
        for m in range(READINGS - 1, -1, -1):
            _back_over_reading(slopes[k, m], gains[k, m], whitened[k, m], roots[k, m], m, slope, bend, reads, by_gain)
        if k > 0:
            _back_over_motion(moves[k - 1], slope, bend, by_gain, room)


@njit(cache=True, error_model="numpy")
def _correct(state: Float64, covariance: Float64, slope: Float64, bend: Float64, room: Float64) -> None:
    """Correct a state and its covariance by what later readings say, in place."""
    _around(bend, covariance, room)
    for i in range(len(state)):
        for j in range(len(state)):
            state[i] += covariance[i, j] * slope[j]
    for i in range(len(state)):
        for j in range(len(state)):
            covariance[i, j] -= room[i, j]


@njit(cache=True, error_model="numpy")
def _back_over_motion(move: Float64, slope: Float64, bend: Float64, by_move: Float64, room: Float64) -> None:
    """Carry slope and curvature back to the state before a prediction, in place.

    Where the state began afresh, nothing is carried, not even what is no number.
    """
    if not move.any():
        for i in range(len(slope)):
            slope[i] = 0.0
            bend[i] = 0.0
        return
    _around(bend, move, room)
    for i in range(len(slope)):
        by_move[i] = 0.0
        for j in range(len(slope)):
            by_move[i] += move[j, i] * slope[j]
    copy_into(slope, 0, by_move)
    copy_matrix(bend, room)


@njit(cache=True, error_model="numpy")
def _back_over_reading(
    slopes: Float64,
    gain: Float64,
    whitened: float,
    root: float,
    m: int,
    slope: Float64,
    bend: Float64,
    reads: Float64,
    by_gain: Float64,
) -> None:
    """Add what a reading says to slope and curvature, in place.

    `reads` and `by_gain` are room.
    """
    size = len(slope)
    is_taken = False
    for i in range(size):
        is_taken = is_taken or gain[i] != 0.0
        reads[i] = 0.0
    if not is_taken:  # there is none, or it moved nothing
        return
    reads[CURRENT if m == 0 else THETA] += slopes[0]
    reads[OMEGA] += slopes[1]
    reads[VOLTAGE] += slopes[2]
    if m == 1:
        reads[ROUNDING] += 1.0
    weight = min(LARGE * LARGE / (whitened * whitened), 1.0) if whitened != 0.0 else 1.0
    pushes = pulls = 0.0
    for i in range(size):
        pushes += gain[i] / weight * slope[i]
        by_gain[i] = 0.0
        for j in range(size):
            by_gain[i] += bend[i, j] * gain[j] / weight
    for i in range(size):
        pulls += gain[i] / weight * by_gain[i]
    more = pulls + root * root / weight
    for i in range(size):
        slope[i] += reads[i] * (whitened * root - pushes)
        for j in range(size):
            bend[i, j] += reads[i] * reads[j] * more - reads[i] * by_gain[j] - by_gain[i] * reads[j]


@njit(cache=True, error_model="numpy")
def _around(inner: Float64, outer: Float64, out: Float64) -> None:
    """Fill in A' B A of an outer matrix A (n, n) and an inner one B (n, n)."""
    n = len(inner)
    for i in range(n):
        for j in range(n):
            out[i, j] = 0.0
    for a in range(n):
        for j in range(n):
            found = 0.0
            for b in range(n):
                found += inner[a, b] * outer[b, j]
            for i in range(n):
                out[i, j] += outer[a, i] * found
