"""Weights of the windows of a run in a fit: inverse variances.

They follow from the residuals of windows of one kind.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.diagnosis.evidence import Evidence
from etb_hil.diagnosis.friction_model import unsettled
from etb_hil.diagnosis.windows import window_means
from etb_hil.recording.samples import Float64, Int64

_LEAST_NOISE = 2e-4  # N·m: twice the rounding error of a current read in steps of 1 mA, at 0.36 N·m/A
# Between these shares of sigma_0, by which friction answers an error of the angle, windows are of one kind: each is
# weighed by the residual of its kind, or of all windows where fewer than this are of one kind.
_KINDS = (0.02, 0.1, 0.5)
_FEWEST = 100


@dataclass(frozen=True, slots=True)
class WindowWeights:
    """Weights (m) of all windows, and of those that slide.

    The latter are 0 where bristles are bent.
    """

    of_all: Float64
    of_sliding: Float64


def weights_of(evidence: Evidence, parameters: Float64, residual: Float64) -> WindowWeights:
    """Return the weights of windows.

    They follow from the parameters (20) and the residual (m) of a fit.
    """
    bent = _bent(evidence, parameters)
    of_all = weights_by_kind(residual, _kinds(bent), evidence)
    return WindowWeights(of_all, np.where((bent <= _KINDS[0]) & evidence.slides, of_all, 0.0))


def kinds_of(evidence: Evidence, parameters: Float64) -> Int64:
    """Return the kind (m) of every window, by how far its bristles are bent.

    Kinds count from 1 on, more bent ones later. The kind is 0 where too few windows are of one kind.
    """
    return _kinds(_bent(evidence, parameters))


def _bent(evidence: Evidence, parameters: Float64) -> Float64:
    """Return the share (m) of sigma_0 by which bristles answer an error of the angle."""
    return window_means(unsettled(evidence.ticks.angle, parameters), evidence.windows.shape.mean, evidence.windows)


def _kinds(bent: Float64) -> Int64:
    kind, named = np.zeros(len(bent), np.int64), 1
    for least, most in zip((-np.inf, *_KINDS), (*_KINDS, np.inf), strict=True):
        inside = (bent > least) & (bent <= most)
        if np.count_nonzero(inside) >= _FEWEST:
            kind[inside] = named
            named += 1
    return kind


def weights_by_kind(residual: Float64, kind: Int64, evidence: Evidence) -> Float64:
    """Return weights of windows (m), by the residuals of their kind.

    Windows that overlap are counted for what they say; those that do not count weigh nothing. Bent bristles only add to
    an error: their kinds never weigh more than what slides, which a local bump may spoil.
    """
    counts, overlap, least = evidence.counts, evidence.overlap, _LEAST_NOISE * _LEAST_NOISE
    weight = np.full(len(residual), 1.0 / (overlap * max(mean_square(residual[counts]), least)))
    for k in range(1, int(kind.max()) + 1):
        same = (kind == k) & counts
        if not np.any(same):
            continue
        least = max(mean_square(residual[same]), least)
        weight[same] = 1.0 / (overlap * least)
    weight[~counts] = 0.0
    return weight


@njit(cache=True, error_model="numpy")
def mean_square(residual: Float64) -> float:
    """Return the mean square of residuals."""
    total = 0.0
    for r in residual:
        total += r * r
    return total / len(residual)
