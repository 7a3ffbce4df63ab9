"""How alike two suspects look in these data: the angle between what they explain, base parameters projected out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.calibration import Calibration
from etb_hil.discrepancy.screening import Screened

Float64 = NDArray[np.float64]

ALIKE = 0.95
# Share of an effect beside the base parameters below which they are its name, too. A fifth is meant; where that lies
# depends by a quarter on how the balances are weighed, and a class too wide is the side to err on.
ABSORBED = 0.25
_GOOD_SHARE = 0.15
_NOTHING = 1e-9


class Projector:
    """Takes out of a sensitivity (n) what the base parameters imitate."""

    def __init__(self, calibration: Calibration) -> None:
        self.names = [u.name for u in calibration.unknowns]
        lengths = np.linalg.norm(calibration.columns, axis=0)
        self._seen = lengths > 1e-6 * max(float(lengths.max(initial=0.0)), 1e-12)
        self._columns = calibration.columns[:, self._seen]
        self._lengths = lengths[self._seen]
        self._basis, self._triangle = np.linalg.qr(self._columns / self._lengths)
        self._bases: dict[frozenset[str], Float64] = {frozenset(): self._basis}

    def rest(self, column: Float64, without: frozenset[str] = frozenset()) -> Float64:
        """Return what of a column is left; the parameters `without` are not used."""
        if without not in self._bases:
            names = np.array(self.names)[self._seen]
            kept = [k for k, name in enumerate(names) if name not in without]
            self._bases[without] = np.linalg.qr(self._columns[:, kept] / self._lengths[kept])[0]
        basis = self._bases[without]
        return np.asarray(column - basis @ (basis.T @ column))

    def imitators(self, column: Float64) -> list[str]:
        """Return the base parameters that do the imitating of a column."""
        solved = np.linalg.lstsq(self._triangle, self._basis.T @ column, rcond=None)[0]
        shares = np.abs(solved) / max(float(np.linalg.norm(column)), _NOTHING)
        names = np.array(self.names)[self._seen]
        return [str(name) for name, share in zip(names, shares, strict=True) if share > _GOOD_SHARE]


def cosine(first: Float64, second: Float64) -> float:
    """Return the cosine of two sensitivities (n), its sign dropped."""
    lengths = float(np.linalg.norm(first) * np.linalg.norm(second))
    return abs(float(first @ second)) / lengths if lengths > _NOTHING else 0.0


def rest_of(projector: Projector, screened: Screened, suspected: str = "") -> Float64:
    """Return a suspect's sensitivity without what the base imitates; a parameter that is `suspected` is no base."""
    return projector.rest(screened.sensitivity, frozenset({screened.candidate.frees, suspected} - {""}))
