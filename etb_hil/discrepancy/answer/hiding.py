"""What may hide an effect: other numbers of the model take of it what their tolerances let them, and no more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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
    """What may hide an effect: its normal equations (k, k), and how far each number may move from where it is.

    `cross` (k) and `own` are those of the effect's column.
    """

    normal: Float64
    low: Float64
    high: Float64
    cross: Float64
    own: float

    @classmethod
    def of(cls, findings: Findings, column: Float64, causes: Sequence[Round]) -> Hiding:
        """Return what may hide an effect with this column (n) beside all causes, as if `causes` were not there."""
        final = findings.final
        own = tuple(f"{each.winner.id}." for each in causes)
        frees = {each.winner.candidate.frees for each in causes}
        stated = {u.name: u for u in findings.calibration.unknowns}
        kept = [k for k, u in enumerate(final.unknowns) if not u.name.startswith(own)]
        unknowns = [stated[u.name] if u.name in frees else u for u in (final.unknowns[k] for k in kept)]
        low, high = np.array([u.low for u in unknowns]), np.array([u.high for u in unknowns])
        x = np.clip(np.array([u.x_of(final.fit.whole) for u in unknowns]), low, high)
        columns = final.columns[:, kept]
        normal = columns.T @ columns + _RIDGE * np.eye(len(kept))
        return cls(normal, low - x, high - x, columns.T @ column, float(column @ column))

    def left(self, size: float) -> float:
        """Return the length of what is left of so much of the column."""
        right = size * self.cross
        x = boxed(self.normal, right, self.low, self.high)
        left = size**2 * self.own + float(x @ self.normal @ x) - 2.0 * float(right @ x)
        return max(left, _NOTHING) ** 0.5

    def smallest(self, least: float, most: float, way: float) -> float | None:
        """Return the smallest size, up or down (`way`), of which `least` is left; None where less is left of `most`."""
        low, high = least / max(self.own, _NOTHING) ** 0.5, most
        if low >= most or self.left(way * most) < least:
            return None
        while high > (1.0 + _NEAR) * low:
            middle = float(np.sqrt(low * high))
            # What is left grows no less than in proportion: short of the size or beyond it, each try bounds it twice.
            other = middle * least / self.left(way * middle)
            low, high = max(low, min(middle, other)), min(high, max(middle, other))
        return high
