"""Leave-one-segment-out cross-validation, linearised about a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration
from etb_hil.discrepancy.fitting.fit import Fit, box_least_squares
from etb_hil.discrepancy.fitting.unknowns import Unknown, box_of, moved
from etb_hil.plant.physics import Vector
from etb_hil.recording.samples import Float64

FOLDS = 10
_RIDGE = 1e-3
# What the other segments say nothing of is known from the model file alone: the variance of a tolerance is a third.
_PRIOR = 3.0


@dataclass(frozen=True, slots=True)
class HeldOut:
    """Squared residual (folds) under parameters `x` (folds, unknowns) of the others."""

    cost: Float64
    x: Float64


def fold_of(balances: Sequence[Balances], segments: int = FOLDS) -> NDArray[np.int64]:
    """Return the fold (n) of each sample of the residual: folds of equal duration."""
    parts = []
    total = sum(b.samples for b in balances)
    done = 0
    for b in balances:
        place = (done + np.arange(b.samples)) * segments // total
        parts.append(np.tile(place, 3))
        done += b.samples
    return np.concatenate(parts)


class Slopes:
    """A Jacobian (n, unknowns) by the folds of its samples (n).

    Their normal matrices serve every residual.
    """

    def __init__(self, jacobian: Float64, unknowns: Sequence[Unknown], segment: NDArray[np.int64]) -> None:
        self._unknowns, self._jacobian = unknowns, jacobian
        ends = [0, *(np.flatnonzero(np.diff(segment)) + 1).tolist(), len(segment)]
        runs = [slice(*each) for each in pairwise(ends)]
        self._folds = [[run for run in runs if segment[run.start] == k] for k in range(FOLDS)]
        self._normals = [sum(jacobian[run].T @ jacobian[run] for run in fold) for fold in self._folds]

    def held_out(self, fit: Fit) -> HeldOut:
        """Return the cost of each fold under parameters fitted on the others."""
        low, high = box_of(self._unknowns)
        x = np.clip([u.x_of(fit.whole) for u in self._unknowns], low, high)
        rights = [-sum(self._jacobian[run].T @ fit.residual[run] for run in fold) for fold in self._folds]
        # Effects' parameters have no tolerance.
        stated = np.array([0.0 if "." in u.name else _PRIOR for u in self._unknowns])
        normal, right = sum(self._normals) + np.diag(stated), sum(rights) - stated * x
        cost = np.empty(FOLDS)
        found = np.empty((FOLDS, len(x)))
        for k, fold in enumerate(self._folds):
            others = normal - self._normals[k] + _RIDGE * np.eye(len(x)) + np.diag(1e-9 * np.diag(normal))
            step = box_least_squares(others, right - rights[k], low - x, high - x)
            lefts = [fit.residual[run] + self._jacobian[run] @ step for run in fold]
            cost[k] = sum(float(left @ left) for left in lefts)
            found[k] = x + step
        return HeldOut(cost, found)

    def vectors(self, fit: Fit) -> list[Vector]:
        """Return the whole vectors (folds) that are fitted on the others."""
        return [moved(fit.whole, self._unknowns, x) for x in self.held_out(fit).x]


def held_out(fit: Fit, jacobian: Float64, unknowns: Sequence[Unknown], segment: NDArray[np.int64]) -> HeldOut:
    """Return the cost of each fold under parameters fitted on the others."""
    return Slopes(jacobian, unknowns, segment).held_out(fit)


def t_of(after: Calibration, before: Calibration, balances: Sequence[Balances]) -> float:
    """Return Student's t of a fit's gain over the one before, over the folds."""
    segment = fold_of(balances)
    with_it, without = (held_out(one.fit, one.jacobian, one.unknowns, segment).cost for one in (after, before))
    gain = without - with_it
    spread = float(np.std(gain, ddof=1)) / np.sqrt(len(gain))
    return float(np.mean(gain)) / spread if spread > 0.0 else 0.0
