"""What may hide an effect: other numbers of the model take of it what their tolerances let them, and no more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.fitting.boxed import boxed
from etb_hil.discrepancy.search.findings import Findings, Round

Float64 = NDArray[np.float64]

_RIDGE = 1e-3
_NEAR = 0.02  # of a size: as well as it is looked for
_NOTHING = 1e-12


@dataclass(frozen=True, slots=True)
class Hiding:
    """What may hide an effect, in normal equations by group of samples: (groups, k, k), and of its column (groups, k).

    `own` (groups): the column's own squares; `low` and `high` (k): how far each number may move from where it is. What
    is left shows from the squares `least` on, if in one group (groups) there are as many as `least_in` it.
    """

    normals: Float64
    low: Float64
    high: Float64
    crosses: Float64
    own: Float64
    least: float
    least_in: Float64

    def shown(self, size: float) -> float:
        """Return how much is left of so much of the column; 1 is just enough."""
        cross, normal = size * self.crosses.sum(0), self.normals.sum(0) + _RIDGE * np.eye(len(self.low))
        x = boxed(normal, cross, self.low, self.high)
        squares = size**2 * self.own + x @ self.normals @ x - 2.0 * size * self.crosses @ x
        share = min(float(squares.sum()) / self.least, float((squares / self.least_in).max()))
        return max(share, _NOTHING) ** 0.5

    def smallest(self, most: float, way: float) -> float | None:
        """Return the smallest size, up or down (`way`), that shows; None where `most` does not."""
        low, high = (self.least / max(float(self.own.sum()), _NOTHING)) ** 0.5, most
        if low >= most or self.shown(way * most) < 1.0:
            return None
        while high > (1.0 + _NEAR) * low:
            middle = float(np.sqrt(low * high))
            # The residual grows no less than in proportion: short of the size or beyond it, each try bounds it twice.
            other = middle / self.shown(way * middle)
            low, high = max(low, min(middle, other)), min(high, max(middle, other))
        return high


class Hidden:
    """The model with all causes in normal equations, summed once for all effects that it may hide."""

    def __init__(self, findings: Findings, least: float, least_in: Float64) -> None:
        """Take what has to be left of an effect that shows: squares of the residual, and those in one group (9)."""
        groups = np.concatenate([b.judged_groups() for b in findings.balances])
        self._order = np.argsort(groups, kind="stable")
        ends = np.searchsorted(groups[self._order], np.arange(len(least_in) + 1))
        self._parts = [slice(first, last) for first, last in pairwise(ends)]
        self._columns = findings.final.columns[self._order]
        self._normals = np.stack([self._columns[part].T @ self._columns[part] for part in self._parts])
        self._findings, self._least, self._least_in = findings, least, least_in

    def by(self, column: Float64, causes: Sequence[Round]) -> Hiding:
        """Return what may hide an effect with this column (n), as if these `causes` were not there."""
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
        return Hiding(normals, low - x, high - x, crosses, squares, self._least, self._least_in)
