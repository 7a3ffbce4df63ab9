"""A last fit in free run: what no balance sees of a number, a run by the voltage alone integrates.

A model whose term has not quite the shape of the truth leaves little in the balances and much in free run, for the
plate stops elsewhere. Begun where the balances ended, with what they say of every number kept beside, such a fit finds
no false minimum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy import freerun
from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.calibration import Calibration
from etb_hil.discrepancy.fit import Residual, fit_of, gauss_newton
from etb_hil.discrepancy.segments import SEGMENTS, segment_of
from etb_hil.discrepancy.unknowns import Unknown
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector

Float64 = NDArray[np.float64]

_RATE = 100.0  # Hz at which a free run is compared: an angle has nothing faster that integrates
_NEWS = 50.0  # independent readings a segment of a free run counts for
_BALANCES_COUNT = 0.02  # beside it: their rows are many, and see the wrong shape of a term as well as its size
_ROUNDS = 2  # of which each may ask for columns anew: beyond them little was gained
_RIDGE = 1e-6


@dataclass(frozen=True, slots=True)
class Followed:
    """The whole vector that follows the measured motion best, and those found without each of the held-out parts."""

    whole: Vector
    held_out: list[Vector]


def follow(balances: Sequence[Balances], b: Balances, calibration: Calibration, floor: float) -> Followed:
    """Fit a calibration's unknowns to free runs of the stretch `b`; `floor`: the error in SI of a true model there."""
    unknowns = [u for u in calibration.unknowns if u.place < EXTENDED]
    own = [k for k, u in enumerate(calibration.unknowns) if u.place < EXTENDED]
    begin = calibration.fit.whole
    columns, residual = calibration.columns[:, own], calibration.fit.residual
    runs = _Runs(b, freerun.starts(b, begin[:EXTENDED]), floor)
    fold_of_run = np.array([fold_of(balances, b, share) for share in runs.shares])
    fold_of_row = segment_of(balances)
    said = _Said(unknowns, begin, columns, residual)
    whole_residual = _together(runs, said, np.ones(len(fold_of_run), bool))
    fit, found = gauss_newton(whole_residual, fit_of(whole_residual, begin), unknowns, _ROUNDS, tolerance=0.02)
    held_out = []
    for fold in range(SEGMENTS):
        seen = fold_of_run != fold
        rows = fold_of_row != fold
        others = _Said(unknowns, begin, columns[rows], residual[rows])
        own_residual = _together(runs, others, seen)
        first = np.concatenate([found[: runs.rows * len(seen)][np.repeat(seen, runs.rows)], others.root])
        part, _ = gauss_newton(own_residual, fit_of(own_residual, fit.whole), unknowns, 1, first=first)
        held_out.append(part.whole)
    return Followed(fit.whole, held_out)


def fold_of(balances: Sequence[Balances], b: Balances, share: float) -> int:
    """Return the held-out part that a share (0 to 1) of the stretch `b` lies in."""
    before = 0
    for each in balances:
        if each is b:
            break
        before += each.rows
    total = sum(each.rows for each in balances)
    return min(int((before + share * b.rows) * SEGMENTS / total), SEGMENTS - 1)


class _Runs:
    """Free runs over all segments of a stretch, from given starts, over the error of a true model."""

    def __init__(self, b: Balances, starts: Float64, floor: float) -> None:
        self._b, self._starts = b, starts
        length = round(freerun.SEGMENT_S * b.measured.rate)
        self._length = length
        self._begins = range(0, len(b.measured) - length + 1, length)
        self._every = max(1, round(b.measured.rate / _RATE))
        self.rows = len(range(0, length, self._every))
        self.shares = [begin / len(b.measured) for begin in self._begins]
        self._weight = np.sqrt(_NEWS / self.rows) / floor

    def errors(self, whole: Vector, seen: NDArray[np.bool_]) -> Float64:
        """Return the weighted errors (n) of the segments that are seen."""
        found = []
        for number, begin in enumerate(self._begins):
            if seen[number]:
                part = slice(begin, begin + self._length, self._every)
                angle = freerun.segment(self._b, whole[:EXTENDED], begin, self._starts[number], self._length)
                found.append((angle[:: self._every] - self._b.measured.angle[part]) * self._weight)
        return np.concatenate(found)


class _Said:
    """What balances say of the unknowns, as a few rows: their residual, linearised about where they ended."""

    def __init__(self, unknowns: Sequence[Unknown], begin: Vector, columns: Float64, residual: Float64) -> None:
        self._unknowns = unknowns
        self._x = np.array([u.x_of(begin) for u in unknowns])
        normal = _BALANCES_COUNT * (columns.T @ columns)
        self.root = np.linalg.cholesky(normal + (_RIDGE + 1e-9 * np.trace(normal)) * np.eye(len(normal))).T
        self._off = np.linalg.solve(self.root.T, _BALANCES_COUNT * (columns.T @ residual))

    def errors(self, whole: Vector) -> Float64:
        """Return what stands for the balances' residual (unknowns)."""
        return np.asarray(self.root @ (np.array([u.x_of(whole) for u in self._unknowns]) - self._x) + self._off)


def _together(runs: _Runs, said: _Said, seen: NDArray[np.bool_]) -> Residual:
    return lambda whole: np.concatenate([runs.errors(whole, seen), said.errors(whole)])
