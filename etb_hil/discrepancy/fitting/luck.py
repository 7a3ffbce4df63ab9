"""How far two true models are apart that rest at other places between the steps of a coarse encoder.

At rest an encoder is off by the same part of a step all the time. A dozen rests are a dozen readings, however many
samples they have: what one simulation leaves of them says little about what the unit leaves. That holds for a
velocity, too: it is off where the angle steps, and a plate that is held next to an edge steps to and fro as long as
it is held.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.fitting.balances import Balances

Float64 = NDArray[np.float64]

# Decision 0029. Healthy units by these: benchmarks/explain_study.py, kind `nothing`, --view coarse_encoder.
_MATTERS = 0.1  # of a balance's noise, from where an encoder's steps are looked at
_SURE = 3.0  # standard deviations
_SPREAD = 1.6  # times their mean squared: the variance by which two mean squares of one reading each are apart


def luck(balances: Sequence[Balances]) -> Float64:
    """Return how many times (9) another true model's mean square may be what one leaves, by group; 1 for fine steps."""
    shares = np.max([b.share_of_steps for b in balances], axis=0)
    shares = np.where(shares > _MATTERS, shares, 0.0)
    rows, squares = sum((_rows(b) for b in balances), np.zeros((2, 9)))
    return np.asarray(1.0 + _SURE * np.repeat(shares, 3) * np.sqrt(_SPREAD * squares) / np.maximum(rows, 1.0))


def _rows(balances: Balances) -> Float64:
    """Return the judged samples by group, and the sum of squares of those that have one and the same angle (2, 9)."""
    steps = np.abs(np.diff(balances.spectrum.picked(balances.measured.angle), prepend=np.nan)) > 0.0
    place = np.cumsum(steps)
    found = np.zeros((2, 9))
    for channel, groups in enumerate(np.split(balances.judged_groups(), 3)):
        for group in range(3 * channel, 3 * channel + 3):
            each = np.bincount(place[groups == group]).astype(np.float64)
            found[:, group] = each.sum(), each @ each
    return found
