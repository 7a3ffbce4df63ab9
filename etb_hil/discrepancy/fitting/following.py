"""A last fit in free run: what no balance sees of a number, a run by the voltage alone integrates.

A model whose term has not quite the shape of the truth leaves little in the balances and much in free run, for the
plate stops elsewhere. Begun where the balances ended, with what they say of every number kept beside, such a fit finds
no false minimum.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.side_by_side import side_by_side
from etb_hil.discrepancy.fitting import freerun
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration
from etb_hil.discrepancy.fitting.fit import Fit, fit_of, gauss_newton
from etb_hil.discrepancy.fitting.segments import SEGMENTS, held_out, segment_of
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector

Float64 = NDArray[np.float64]

# Decision 0033. Free runs by these: benchmarks/explain_study.py, --holdout.
_RATE = 100.0  # Hz at which a free run is compared: an angle has nothing faster that integrates
_NEWS = 50.0  # independent readings a segment of a free run counts for, beside the balances' samples
_MOST = 2.0  # times a true model's error: what is more is a plate that broke away in one of two, and no number's fault
_ROUNDS = 2  # of which each may ask for columns anew: beyond them little was gained
_TOLERANCE = 0.02
_RIDGE = 1e-6


@dataclass(frozen=True, slots=True)
class Followed:
    """The whole vector that follows the measured motion best, and those found without each of the held-out parts."""

    whole: Vector
    held_out: list[Vector]


def follow(
    balances: Sequence[Balances],
    number: int,
    calibration: Calibration,
    floor: float,
    progress: Callable[[str], None] = lambda _: None,
) -> Followed:
    """Fit a calibration's unknowns to free runs of one of the segments of the calibration.

    `number`: the segment; `floor`: the error in SI of a true model there.
    """
    progress("fitting a last time, in free run")
    b, begin = balances[number], calibration.fit.whole
    own = [k for k, u in enumerate(calibration.unknowns) if u.place < EXTENDED]
    unknowns = [calibration.unknowns[k] for k in own]
    columns, residual = calibration.columns[:, own], calibration.fit.residual
    runs = _Runs(b, begin, floor)
    said = _Said(unknowns, begin, columns, residual)

    def together(whole: Vector) -> Float64:
        return np.concatenate([runs.errors(whole), said.errors(whole)])

    fit, found = gauss_newton(together, fit_of(together, begin), unknowns, _ROUNDS, tolerance=_TOLERANCE)
    progress("fitting a last time, in free run, without each part of the record")
    # The whole fit with the balances' samples for what they say together, so that both can be left out part by part.
    rows = len(runs.shares) * runs.rows
    left = np.concatenate([fit.residual[:rows], said.rows(fit.whole)])
    part = np.repeat([part_of(balances, number, share) for share in runs.shares], runs.rows)
    slopes = np.vstack([found[:rows], columns])
    at = Fit(fit.whole, left, float(left @ left))
    x = held_out(at, slopes, unknowns, np.concatenate([part, segment_of(balances)])).x
    return Followed(fit.whole, [_put(fit.whole, unknowns, values) for values in x])


def _put(whole: Vector, unknowns: Sequence[Unknown], values: Float64) -> Vector:
    found = whole.copy()
    for unknown, value in zip(unknowns, values, strict=True):
        unknown.put(found, float(value))
    return found


def part_of(balances: Sequence[Balances], number: int, share: float) -> int:
    """Return the held-out part that a share (0 to 1) of a segment, given by its number, lies in."""
    before = sum(b.rows for b in balances[:number])
    total = sum(b.rows for b in balances)
    return min(int((before + share * balances[number].rows) * SEGMENTS / total), SEGMENTS - 1)


class _Runs:
    """Free runs over all parts of a segment, from where `begin` starts them, over the error of a true model."""

    def __init__(self, b: Balances, begin: Vector, floor: float) -> None:
        self._b, self._starts = b, freerun.starts(b, begin[:EXTENDED])
        length = round(freerun.SEGMENT_S * b.measured.rate)
        self._length = length
        self._begins = range(0, len(b.measured) - length + 1, length)
        self._every = max(1, round(b.measured.rate / _RATE))
        self.rows = len(range(0, length, self._every))
        self.shares = [begin / len(b.measured) for begin in self._begins]
        self._weights = np.full(len(self._begins), np.sqrt(_NEWS / self.rows) / floor)
        over = np.linalg.norm(self.errors(begin).reshape(-1, self.rows), axis=1) / np.sqrt(_NEWS)
        self._weights *= _MOST / np.maximum(over, _MOST)

    def errors(self, whole: Vector) -> Float64:
        """Return the weighted errors (n) of all segments."""

        def run(number: int) -> Float64:
            begin = self._begins[number]
            part = slice(begin, begin + self._length, self._every)
            angle = freerun.segment(self._b, whole[:EXTENDED], begin, self._starts[number], self._length)
            return (angle[:: self._every] - self._b.measured.angle[part]) * self._weights[number]

        return np.concatenate([*side_by_side(run, range(len(self._begins)))])


class _Said:
    """What balances say of the unknowns, as a few samples: their residual, linearised about where they ended."""

    def __init__(self, unknowns: Sequence[Unknown], begin: Vector, columns: Float64, residual: Float64) -> None:
        self._unknowns, self._columns, self._residual = unknowns, columns, residual
        self._x = np.array([u.x_of(begin) for u in unknowns])
        normal = columns.T @ columns
        self._root = np.linalg.cholesky(normal + (_RIDGE + 1e-9 * np.trace(normal)) * np.eye(len(normal))).T
        self._off = np.linalg.solve(self._root.T, columns.T @ residual)

    def errors(self, whole: Vector) -> Float64:
        """Return what stands for the balances' residual (unknowns)."""
        return np.asarray(self._root @ self._moved(whole) + self._off)

    def rows(self, whole: Vector) -> Float64:
        """Return the balances' residual (n), linearised."""
        return np.asarray(self._residual + self._columns @ self._moved(whole))

    def _moved(self, whole: Vector) -> Float64:
        return np.array([u.x_of(whole) for u in self._unknowns]) - self._x
