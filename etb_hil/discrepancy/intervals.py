"""Intervals of fitted numbers from blocks of the record, since residuals next to each other are no news."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.calibration import Calibration
from etb_hil.discrepancy.segments import segment_of

Float64 = NDArray[np.float64]

_BLOCKS = 40
_Z = 2.02  # Student's 97.5 % of 40 blocks
_RIDGE = 1e-3


@dataclass(frozen=True, slots=True)
class Estimate:
    """A fitted number with its 95 % interval, SI."""

    name: str
    place: int
    value: float
    low: float
    high: float
    on_bound: bool


def estimates(calibration: Calibration, balances: Sequence[Balances]) -> list[Estimate]:
    """Return every unknown of a fit with its interval: a sandwich over blocks; what lies on a bound is held there."""
    unknowns, fit, columns = calibration.unknowns, calibration.fit, calibration.columns
    x = np.array([u.x_of(fit.whole) for u in unknowns])
    bound = np.array([v <= u.low + 1e-6 or v >= u.high - 1e-6 for u, v in zip(unknowns, x, strict=True)])
    free = np.flatnonzero(~bound)
    spread = np.zeros(len(x))
    if len(free):
        inner = columns[:, free]
        normal = inner.T @ inner + _RIDGE * np.eye(len(free))
        block = segment_of(balances, _BLOCKS)
        scores = np.stack([inner[block == k].T @ fit.residual[block == k] for k in range(_BLOCKS)])
        scores -= scores.mean(0)
        inverse = np.linalg.pinv(normal, rcond=1e-13, hermitian=True)
        half = scores @ inverse
        spread[free] = np.sqrt((half**2).sum(0) * _BLOCKS / (_BLOCKS - 1.0))
    found = []
    for k, unknown in enumerate(unknowns):
        value = float(fit.whole[unknown.place])
        reach = _Z * spread[k] * unknown.scale
        found.append(Estimate(unknown.name, unknown.place, value, value - reach, value + reach, bool(bound[k])))
    return found
