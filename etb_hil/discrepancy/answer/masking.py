"""Masking: how far base parameters within their tolerances hide an effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.fitting.box_least_squares import box_least_squares
from etb_hil.discrepancy.search.findings import Findings, SelectionStep

Float64 = NDArray[np.float64]

_RIDGE = 1e-3
_NEAR = 0.02  # of a size: as well as it is looked for
_NOTHING = 1e-12


@dataclass(frozen=True, slots=True)
class MaskedEffect:
    """Normal equations by group of samples (groups, k, k), and of an effect.

    `own` (groups): the effect's squares; `low` and `high` (k): how far each parameter may move. The effect is
    detectable if it leaves the squares `least`, and in one group (groups) `least_in` it.
    """

    normals: Float64
    low: Float64
    high: Float64
    crosses: Float64
    own: Float64
    least: float
    least_in: Float64

    def shown(self, size: float) -> float:
        """Return how detectable a size of the effect is; 1 is just enough."""
        cross, normal = size * self.crosses.sum(0), self.normals.sum(0) + _RIDGE * np.eye(len(self.low))
        x = box_least_squares(normal, cross, self.low, self.high)
        squares = size**2 * self.own + x @ self.normals @ x - 2.0 * size * self.crosses @ x
        share = min(float(squares.sum()) / self.least, float((squares / self.least_in).max()))
        return max(share, _NOTHING) ** 0.5

    def smallest(self, most: float, way: float) -> float | None:
        """Return the smallest detectable size, up or down (`way`); None if `most` is not."""
        low, high = (self.least / max(float(self.own.sum()), _NOTHING)) ** 0.5, most
        if low >= most or self.shown(way * most) < 1.0:
            return None
        while high > (1.0 + _NEAR) * low:
            middle = float(np.sqrt(low * high))
            # The residual grows no less than in proportion: short of the size or beyond it, each try bounds it twice.
            other = middle / self.shown(way * middle)
            low, high = max(low, min(middle, other)), min(high, max(middle, other))
        return high


class Masking:
    """The final model in normal equations, summed once for all effects."""

    def __init__(self, findings: Findings, least: float, least_in: Float64) -> None:
        """Take the squares that a detectable effect leaves, in all and in one group (9)."""
        groups = np.concatenate([b.judged_groups() for b in findings.balances])
        self._order = np.argsort(groups, kind="stable")
        ends = np.searchsorted(groups[self._order], np.arange(len(least_in) + 1))
        self._parts = [slice(first, last) for first, last in pairwise(ends)]
        self._columns = findings.final.jacobian[self._order]
        self._normals = np.stack([self._columns[part].T @ self._columns[part] for part in self._parts])
        self._findings, self._least, self._least_in = findings, least, least_in

    def by(self, column: Float64, causes: Sequence[SelectionStep]) -> MaskedEffect:
        """Return the masking of an effect by its sensitivity (n), without these `causes`."""
        final = self._findings.final
        own = tuple(f"{each.winner.id}." for each in causes)
        frees = {each.winner.candidate.frees for each in causes}
        stated = {u.name: u for u in self._findings.calibration.unknowns}
        kept = [k for k, u in enumerate(final.unknowns) if not u.name.startswith(own)]
        unknowns = [stated[u.name] if u.name in frees else u for u in (final.unknowns[k] for k in kept)]
        low, high = np.array([u.low for u in unknowns]), np.array([u.high for u in unknowns])
        x = np.clip(np.array([u.x_of(final.fit.whole) for u in unknowns]), low, high)
        sorted_ = column[self._order]
        crosses = np.stack([self._columns[part].T @ sorted_[part] for part in self._parts])[:, kept]
        squares = np.array([float(sorted_[part] @ sorted_[part]) for part in self._parts])
        normals = self._normals[:, kept][:, :, kept]
        return MaskedEffect(normals, low - x, high - x, crosses, squares, self._least, self._least_in)
