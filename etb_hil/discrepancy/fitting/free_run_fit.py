"""A last fit in free run, which integrates what no balance sees.

A model whose term differs a little from the true shape leaves little in the balances and much in free run, for the
plate stops elsewhere. Begun where the balances ended, and with their evidence on every parameter as a prior, such a fit
finds no false minimum.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.base.side_by_side import side_by_side
from etb_hil.discrepancy.fitting import free_run
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration
from etb_hil.discrepancy.fitting.cross_validation import FOLDS, Slopes, fold_of
from etb_hil.discrepancy.fitting.fit import Fit, fit_of, gauss_newton
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector
from etb_hil.recording.samples import Float64

# Decision 0033. Free runs by these: benchmarks/explain_study.py, --holdout.
_RATE = 100.0  # Hz at which a free run is compared: an angle has nothing faster that integrates
_NEWS = 50.0  # independent readings a segment of a free run counts for, beside the balances' samples
_MOST = 2.0  # times a true model's error: what is more is a plate that broke away in one of two, and no number's fault
_ITERATIONS = 1  # a second step, with a new Jacobian, did not reduce the error; held-out fits use that of the first
_RIDGE = 1e-6


@dataclass(frozen=True, slots=True)
class FreeRunFit:
    """The vector that follows the motion best, and those fitted without each fold."""

    whole: Vector
    held_out: list[Vector]


def fit_free_run(
    balances: Sequence[Balances],
    number: int,
    calibration: Calibration,
    noise_floor: float,
    ticks: int,
    progress: Callable[[str], None] = lambda _: None,
) -> FreeRunFit:
    """Fit a calibration's unknowns to free runs of one segment.

    `number`: the segment; `noise_floor`: the error in SI of a true model there; `ticks`: steps a sample.
    """
    progress("fitting a last time, in free run")
    b, begin = balances[number], calibration.fit.whole
    own = [k for k, u in enumerate(calibration.unknowns) if u.place < EXTENDED]
    unknowns = [calibration.unknowns[k] for k in own]
    jacobian, residual = calibration.jacobian[:, own], calibration.fit.residual
    runs = _Runs(b, begin, noise_floor, ticks)
    said = _Said(unknowns, begin, jacobian, residual)

    def together(whole: Vector) -> Float64:
        return np.concatenate([runs.errors(whole), said.errors(whole)])

    fit, found = gauss_newton(together, fit_of(together, begin), unknowns, _ITERATIONS)
    progress("fitting a last time, in free run, without each part of the record")
    # The whole fit with the balances' samples for what they say together, so that both can be left out part by part.
    samples = len(runs.shares) * runs.samples
    left = np.concatenate([fit.residual[:samples], said.samples(fit.whole)])
    part = np.repeat([part_of(balances, number, share) for share in runs.shares], runs.samples)
    slopes = np.vstack([found[:samples], jacobian])
    at = Fit(fit.whole, left, float(left @ left))
    folds = Slopes(slopes, unknowns, np.concatenate([part, fold_of(balances)]))
    return FreeRunFit(fit.whole, folds.vectors(at))


def part_of(balances: Sequence[Balances], number: int, share: float) -> int:
    """Return the fold of a share (0 to 1) of a segment, given by its number."""
    before = sum(b.samples for b in balances[:number])
    total = sum(b.samples for b in balances)
    return min(int((before + share * balances[number].samples) * FOLDS / total), FOLDS - 1)


class _Runs:
    """Free runs over parts of a segment from `begin`, over a true model's error.

    There is a part for each fold, evenly along the segment: more of them say little more, and each costs a simulation
    for each unknown.
    """

    def __init__(self, b: Balances, begin: Vector, noise_floor: float, ticks: int) -> None:
        self._b, self._starts, self._ticks = b, free_run.starts(b, begin[:EXTENDED]), ticks
        length = round(free_run.SEGMENT_S * b.measured.rate)
        self._length = length
        parts = np.arange(len(self._starts))
        self._parts = parts[:: max(1, len(parts) // FOLDS)]
        self._every = max(1, round(b.measured.rate / _RATE))
        self.samples = len(range(0, length, self._every))
        self.shares = [part * length / len(b.measured) for part in self._parts]
        news = _NEWS * len(parts) / len(self._parts)
        self._weights = np.full(len(self._parts), np.sqrt(news / self.samples) / noise_floor)
        over = np.linalg.norm(self.errors(begin).reshape(-1, self.samples), axis=1) / np.sqrt(news)
        self._weights *= _MOST / np.maximum(over, _MOST)

    def errors(self, whole: Vector) -> Float64:
        """Return the weighted errors (n) of all segments."""

        def run(number: int) -> Float64:
            begin = int(self._parts[number]) * self._length
            part = slice(begin, begin + self._length, self._every)
            at = self._starts[self._parts[number]]
            angle, _ = free_run.segment(self._b, whole[:EXTENDED], begin, at, self._length, self._ticks)
            return (angle[:: self._every] - self._b.measured.angle[part]) * self._weights[number]

        return np.concatenate([*side_by_side(run, range(len(self._parts)))])


class _Said:
    """The balances' evidence on the unknowns, linearised and condensed."""

    def __init__(self, unknowns: Sequence[Unknown], begin: Vector, jacobian: Float64, residual: Float64) -> None:
        self._unknowns, self._columns, self._residual = unknowns, jacobian, residual
        self._x = np.array([u.x_of(begin) for u in unknowns])
        normal = jacobian.T @ jacobian
        self._root = np.linalg.cholesky(normal + (_RIDGE + 1e-9 * np.trace(normal)) * np.eye(len(normal))).T
        self._off = np.linalg.solve(self._root.T, jacobian.T @ residual)

    def errors(self, whole: Vector) -> Float64:
        """Return the condensed residual of the balances (unknowns)."""
        return np.asarray(self._root @ self._away(whole) + self._off)

    def samples(self, whole: Vector) -> Float64:
        """Return the balances' residual (n), linearised."""
        return np.asarray(self._residual + self._columns @ self._away(whole))

    def _away(self, whole: Vector) -> Float64:
        return np.array([u.x_of(whole) for u in self._unknowns]) - self._x
