"""The smoother of Rauch, Tung and Striebel (1965) on the matrices of the filter."""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.recording.samples import Float64

_LEAST = 1e-12  # of a scaled covariance: keeps a state that nothing moves from making it singular


def smooth(states: Float64, covariances: Float64, moves: Float64, ahead: Float64, spreads: Float64) -> None:
    """Turn filtered states and covariances into smoothed ones, in place.

    States are (n, s), covariances (n, s, s).

    `moves` (n, s, s): of each prediction, by the state before; `ahead` (n, s) and `spreads` (n, s, s): the state and
    the covariance that were predicted from each sample.
    """
    # The gain G = P F' (P-)^-1, scaled: angles and voltages differ by many orders.
    scale = 1.0 / np.sqrt(np.diagonal(spreads, axis1=1, axis2=2) + 1e-300)
    scaled = spreads * scale[:, :, None] * scale[:, None, :] + _LEAST * np.eye(states.shape[1])
    cross = (moves @ covariances) * scale[:, :, None]
    gains = np.swapaxes(np.linalg.solve(scaled, cross) * scale[:, :, None], 1, 2)
    _back(states, covariances, np.ascontiguousarray(gains), ahead, spreads)


@njit(cache=True, error_model="numpy")
def _back(states: Float64, covariances: Float64, gains: Float64, ahead: Float64, spreads: Float64) -> None:
    size = states.shape[1]
    room = np.zeros((size, size))
    for k in range(len(states) - 2, -1, -1):
        g = gains[k]
        for i in range(size):
            for j in range(size):
                states[k, i] += g[i, j] * (states[k + 1, j] - ahead[k, j])
                room[i, j] = 0.0
                for m in range(size):
                    room[i, j] += g[i, m] * (covariances[k + 1, m, j] - spreads[k, m, j])
        for i in range(size):
            for j in range(size):
                for m in range(size):
                    covariances[k, i, j] += room[i, m] * g[j, m]
