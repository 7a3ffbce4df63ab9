"""How alike two suspects look in these data: the angle between what they explain, base parameters projected out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.calibration import Calibration

Float64 = NDArray[np.float64]

ALIKE = 0.95
# Share of an effect beside the base parameters below which they are its name, too. A fifth is meant; where that lies
# depends by a tenth on how the balances are weighed, and a class too wide is the side to err on.
ABSORBED = 0.22
_GOOD_SHARE = 0.15
_NOTHING = 1e-9


class Projector:
    """Takes out of a sensitivity (n) what the base parameters imitate; one that was measured imitates nothing."""

    def __init__(self, calibration: Calibration) -> None:
        self.names = [u.name for u in calibration.unknowns]
        lengths = np.linalg.norm(calibration.columns, axis=0)
        self._seen = lengths > 1e-6 * max(float(lengths.max(initial=0.0)), 1e-12)
        self._seen &= np.array([not u.is_known for u in calibration.unknowns])
        self._columns = calibration.columns[:, self._seen]
        self._lengths = lengths[self._seen]
        self._basis, self._triangle = np.linalg.qr(self._columns / self._lengths)
        self._freed: dict[frozenset[str], Float64] = {}

    def rest(self, column: Float64, without: frozenset[str] = frozenset()) -> Float64:
        """Return what of a column is left; the parameters `without` are not used."""
        inside = self._basis.T @ column
        if without:
            freed = self._freed_by(without)
            inside = inside - freed @ (freed.T @ inside)
        return np.asarray(column - self._basis @ inside)

    def _freed_by(self, without: frozenset[str]) -> Float64:
        """Return the directions (k, d), in the basis, that only the parameters `without` reach."""
        if without not in self._freed:
            names = np.array(self.names)[self._seen]
            left_out = np.eye(len(names))[:, [name in without for name in names]]
            self._freed[without] = np.linalg.qr(np.linalg.solve(self._triangle.T, left_out))[0]
        return self._freed[without]

    def imitators(self, column: Float64, without: frozenset[str] = frozenset()) -> list[str]:
        """Return the base parameters that do the imitating of a column; those `without` are not used."""
        names = np.array(self.names)[self._seen]
        used = np.array([name not in without for name in names])
        names = names[used]
        solved = np.linalg.lstsq(self._triangle[:, used], self._basis.T @ column, rcond=None)[0]
        shares = np.abs(solved) / max(float(np.linalg.norm(column)), _NOTHING)
        return [str(name) for name, share in zip(names, shares, strict=True) if share > _GOOD_SHARE]
