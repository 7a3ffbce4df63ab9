"""Spread between two true models at rest between the steps of a coarse encoder.

At rest an encoder is off by the same part of a step all the time. A dozen rests are a dozen readings, however many
samples they have: one simulation shows little of what the unit leaves. That holds for a velocity, too: a plate held
next to an edge steps to and fro.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.recording.samples import Float64

# Decision 0029. Healthy units by these: benchmarks/explain_study.py, kind `nothing`, --view coarse_encoder.
_MATTERS = 0.1  # of a balance's noise, from where an encoder's steps are looked at
_SURE = 3.0  # standard deviations
_SPREAD = 1.6  # times their mean squared: the variance by which two mean squares of one reading each are apart


def quantisation_spread(balances: Sequence[Balances]) -> Float64:
    """Return the factor (9) between two true models' mean squares by group; 1 if fine."""
    shares = np.max([b.share_of_steps for b in balances], axis=0)
    shares = np.where(shares > _MATTERS, shares, 0.0)
    samples, squares = sum((_samples(b) for b in balances), np.zeros((2, 9)))
    return np.asarray(1.0 + _SURE * np.repeat(shares, 3) * np.sqrt(_SPREAD * squares) / np.maximum(samples, 1.0))


def _samples(balances: Balances) -> Float64:
    """Return by group (2, 9) the judged samples, and the sum of squared run lengths.

    A run is the samples of one rest: they have one angle.
    """
    steps = np.abs(np.diff(balances.spectrum.picked(balances.measured.angle), prepend=np.nan)) > 0.0
    place = np.cumsum(steps)
    found = np.zeros((2, 9))
    for channel, groups in enumerate(np.split(balances.judged_groups(), 3)):
        for group in range(3 * channel, 3 * channel + 3):
            each = np.bincount(place[groups == group]).astype(np.float64)
            found[:, group] = each.sum(), each @ each
    return found
