"""How far two true models are apart that rest at other places between the steps of a coarse encoder.

At rest an encoder is off by the same part of a step all the time. A dozen rests are a dozen readings, however many rows
they have: what one simulation leaves of them says little about what the unit leaves.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.fitting.balances import Balances

Float64 = NDArray[np.float64]

_MATTERS = 0.1  # of a balance's noise, from where an encoder's steps are looked at
_SURE = 3.0  # standard deviations
_SPREAD = 1.6  # times their mean squared: the variance by which two mean squares of one reading each are apart


def luck(balances: Sequence[Balances]) -> Float64:
    """Return how many times (9) another true model's mean square may be what one leaves, by group; 1 for fine steps."""
    channels = np.max([b.steps for b in balances], axis=0)
    channels = np.where(channels > _MATTERS, channels, 0.0)
    readings = sum((_rows(b) for b in balances), np.zeros((2, 3)))
    apart = np.sqrt(_SPREAD * readings[1]) / np.maximum(readings[0], 1.0)
    return np.asarray(1.0 + _SURE * np.outer(channels, apart).ravel())


def _rows(balances: Balances) -> Float64:
    """Return the rows by regime, and the sum of squares of those that have one and the same angle (2, 3)."""
    m, regimes = balances.measured, balances.regimes
    moves = np.abs(np.diff(balances.spectrum.picked(m.angle), prepend=np.nan)) > 0.0
    place = np.cumsum(moves)
    found = np.zeros((2, 3))
    for regime in range(3):
        each = np.bincount(place[regimes.is_good & (regimes.label == regime)]).astype(np.float64)
        found[:, regime] = each.sum(), each @ each
    return found
