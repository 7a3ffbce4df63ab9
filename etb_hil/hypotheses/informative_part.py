"""Choose the samples of a record that hypotheses are compared by.

What a model lacks may show in a few places only, such as at a stop: samples evenly along the record may miss them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from etb_hil.estimation.filtering import filtered
from etb_hil.estimation.record import Record
from etb_hil.hypotheses.constants import PARTS, SEARCHED
from etb_hil.hypotheses.prepared import prepared
from etb_hil.hypotheses.terms import with_terms
from etb_hil.plant.parameters import Model
from etb_hil.recording.samples import Float64

_OF_DEVIATION = 1.4826  # standard deviation of normal numbers over their median absolute deviation


def informative_part(whole: Record, model: Model) -> Record:
    """Return the samples of a record that are searched.

    Half of them are evenly along it, and the model is calibrated by these. Up to half are where its innovations stand
    out, which chance alone does in no window; the rest is evenly along the record, too. A record that has no more
    samples is returned whole.
    """
    if len(whole) <= SEARCHED:
        return whole
    length = SEARCHED // (4 * PARTS)
    windows, most = len(whole) // length, SEARCHED // length
    taken = np.zeros(windows, np.bool_)
    evenly = np.linspace(0, windows - 2, PARTS).round().astype(int)
    taken[evenly] = taken[evenly + 1] = True
    squared = _squared_innovations(whole, whole.picked(_runs(taken, length)), model)
    by_window = squared[: windows * length].reshape(windows, length).sum(axis=1)
    away = by_window - np.median(by_window)
    # About the largest of so many normal numbers (Cramer 1946): a choice by chance would let noise seem larger.
    chance = math.sqrt(2.0 * math.log(windows)) * _OF_DEVIATION * float(np.median(np.abs(away)))
    order = np.argsort(-away, kind="stable")
    standing_out = order[(away[order] > chance) & ~taken[order]]
    taken[standing_out[: most - np.count_nonzero(taken)]] = True
    others = np.flatnonzero(~taken)
    taken[others[np.linspace(0, len(others) - 1, most - np.count_nonzero(taken)).round().astype(int)]] = True
    return whole.picked(_runs(taken, length))


def _squared_innovations(whole: Record, few: Record, model: Model) -> Float64:
    """Return each sample's squared innovations over their variances (n), summed.

    Large ones are lowered as the filter lowers them. The model is calibrated by few of the samples.
    """
    made = prepared(few, model)
    _, fit = made.calibrated()
    record = with_terms(whole).placed(fit.parameters)
    found = filtered(record, fit.parameters, fit.disturbance)
    return np.asarray(np.sum(np.where(found.roots > 0.0, found.whitened, 0.0) ** 2, axis=1))


def _runs(taken: NDArray[np.bool_], length: int) -> list[slice]:
    """Return the runs of windows that were taken, as slices of samples."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], taken, [False]])))
    return [slice(int(begin) * length, int(end) * length) for begin, end in zip(edges[::2], edges[1::2], strict=True)]
