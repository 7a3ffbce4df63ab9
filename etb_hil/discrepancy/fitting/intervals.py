"""Intervals of fitted parameters: a sandwich over blocks, and a rerun.

Blocks show how a parameter scatters. They do not see what bristles and encoder do equally in every block. A simulation
of the model, whose truth is known, shows that: its error is added. What no block identifies is known as well as the
model file states it. A parameter on a bound of its tolerance may also lie inside, and what is correlated with it then
moves, too. An effect's parameter stays within its bounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.student import student
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration, residual_of
from etb_hil.discrepancy.fitting.cross_validation import fold_of
from etb_hil.discrepancy.fitting.fit import Residual
from etb_hil.discrepancy.fitting.noise_floor import NoiseFloor
from etb_hil.discrepancy.fitting.unknowns import SLACK, Unknown, box_of, moved
from etb_hil.plant.physics import LIMP_HOME, STOP_HIGH, STOP_LOW, Vector
from etb_hil.recording.samples import Float64

# Decision 0033. How often intervals hold: benchmarks/explain_sizes.py.
_BLOCKS = 40
_OF_BLOCKS = float(student(_BLOCKS - 1))
_RIDGE = 1e-3
_STATED = 3.0  # one over the variance of what may be anywhere within a tolerance
_ALONE = 0.99  # of what is known in a direction; a block that has more of it leaves the others nothing to say
TELLS = 0.95  # of an effect's bounds: what an interval has to be narrower than, before they cut it, to tell anything
_PLACES = (LIMP_HOME, STOP_LOW, STOP_HIGH)  # known to no less than an encoder's count: who says where in it zero is


@dataclass(frozen=True, slots=True)
class Estimate:
    """A fitted parameter with its 95 % interval (SI) and its identifiability.

    If it is not identifiable, the interval is about the range of its bounds.
    """

    name: str
    place: int
    value: float
    low: float
    high: float
    on_bound: bool
    is_identifiable: bool = True

    @property
    def flags(self) -> list[str]:
        """Return the remarks on the value and its interval."""
        is_end = self.low < self.high and self.value in (self.low, self.high)
        remarks = {
            "on a bound": self.on_bound,
            "at an end of its interval: identifiable only together with others": is_end and not self.on_bound,
            "not identifiable from these data": not self.is_identifiable,
        }
        return [remark for remark, holds in remarks.items() if holds]


def estimates(calibration: Calibration, balances: Sequence[Balances], noise_floor: NoiseFloor) -> list[Estimate]:
    """Return every unknown of a fit with its interval.

    The interval is a sandwich over blocks, widened by what bounds hold back.
    """
    # By name how far the rerun's calibration ended from the simulated truth.
    off = noise_floor.calibration.fit.whole - noise_floor.truth
    missed = {unknown.name: abs(float(off[unknown.place])) for unknown in noise_floor.calibration.unknowns}
    count = max(b.measured.angle_noise for b in balances) * np.sqrt(12.0)
    unknowns, whole = calibration.unknowns, calibration.fit.whole
    said = _Said.of(residual_of(balances), whole, unknowns, fold_of(balances, _BLOCKS))
    low_ends, high_ends = box_of(unknowns)
    at_high = said.x >= high_ends - 1e-6
    bound = (said.x <= low_ends + 1e-6) | at_high
    drawn, reach = np.zeros((2, len(unknowns)))
    drawn[~bound], reach[~bound] = said.drawn(~bound), said.reach(~bound)
    below, above = np.zeros((2, len(unknowns)))
    if bound.any():
        inward = np.minimum(said.inward(np.where(at_high, 1.0, -1.0)), high_ends - low_ends)
        inward = np.where(bound, inward, 0.0)
        inward = np.where(at_high, -inward, inward)
        along = said.following(bound) * inward[bound]
        below[~bound], above[~bound] = np.minimum(along, 0.0).sum(1), np.maximum(along, 0.0).sum(1)
        below[bound], above[bound] = np.minimum(inward, 0.0)[bound], np.maximum(inward, 0.0)[bound]
    found = []
    for k, unknown in enumerate(unknowns):
        value, scale = float(whole[unknown.place]), unknown.scale
        half = 0.0 if bound[k] else float(np.hypot(reach[k] * scale, _OF_BLOCKS * missed.get(unknown.name, 0.0)))
        if unknown.place in _PLACES:
            half = max(half, count)
        low = min(value, value + drawn[k] * scale - half) + below[k] * scale
        high = max(value, value + drawn[k] * scale + half) + above[k] * scale
        is_identifiable = True
        if _is_of_effect(unknown):
            bottom, top = (unknown.centre + scale * end for end in (unknown.low, unknown.high))
            is_identifiable = bool(unknown.is_known or high - low < TELLS * (top - bottom))
            low, high = max(low, min(bottom, value)), min(high, max(top, value))
        found.append(Estimate(unknown.name, unknown.place, value, low, high, bool(bound[k]), is_identifiable))
    return found


@dataclass(frozen=True, slots=True)
class _Said:
    """Evidence of blocks and model file on the unknowns at the end of a fit, scaled.

    `normals` (blocks, unknowns, unknowns) and `scores` (blocks, unknowns) of the residual; `stated` (unknowns): the
    reciprocal variance of a stated tolerance, 0 where none is stated.
    """

    x: Float64
    normals: Float64
    scores: Float64
    stated: Float64

    @classmethod
    def of(cls, residual: Residual, whole: Vector, unknowns: Sequence[Unknown], block: NDArray[np.int64]) -> _Said:
        """Return it from a fresh Jacobian: collinear effects cancel only in exact ones."""
        left = residual(whole)
        slopes = _slopes(residual, whole, left, unknowns)
        samples = [np.flatnonzero(block == k) for k in range(_BLOCKS)]
        return cls(
            np.array([u.x_of(whole) for u in unknowns]),
            np.stack([slopes[r].T @ slopes[r] for r in samples]),
            np.stack([slopes[r].T @ left[r] for r in samples]),
            np.array([_STATED if _is_stated(u) else 0.0 for u in unknowns]),
        )

    def drawn(self, free: NDArray[np.bool_]) -> Float64:
        """Return how far (free) the model file pulls the `free` unknowns from their fit."""
        return np.asarray(-_inverse(self._normal(free)) @ (self.stated * self.x)[free])

    def reach(self, free: NDArray[np.bool_]) -> Float64:
        """Return the half width (free) of the interval of each `free` unknown.

        Scores are corrected for the leverage of their own block (CR2, Bell and McCaffrey 2002). Student's quantile is
        that of the effective number of blocks (Carter et al. 2017).
        """
        normal, stated = self._normal(free), self.stated[free]
        inverse = _inverse(normal)
        root = np.linalg.cholesky(normal)
        half, news = np.empty((2, _BLOCKS, len(normal)))
        for k in range(_BLOCKS):
            own = self.normals[k][np.ix_(free, free)]
            share, way = np.linalg.eigh(np.linalg.solve(root, np.linalg.solve(root, own).T))
            lifted = way.T @ np.linalg.solve(root, self.scores[k][free])
            lifted /= np.sqrt(1.0 - np.clip(share, 0.0, _ALONE))
            half[k] = np.linalg.solve(root.T, way @ lifted)
            news[k] = np.einsum("ij,jk,ik->i", inverse, own, inverse)
        blocks = news.sum(0) ** 2 / np.maximum((news**2).sum(0), 1e-300)
        # What neither data nor file tell only the ridge holds: it is anywhere, and no block scatters about it.
        from_file = _OF_BLOCKS**2 * (inverse**2 @ (stated + _RIDGE))
        return np.asarray(np.sqrt(student(blocks - 1.0) ** 2 * (half**2).sum(0) + from_file))

    def inward(self, side: Float64) -> Float64:
        """Return how far inside its bound each unknown may lie; `side`: 1 upper, -1 lower.

        That far the likelihood has fallen from the bound by as much as from its peak to the end of an interval. A
        gradient that pushes from farther beyond the bound than an interval reaches is evidence against bound or model,
        and narrows nothing.
        """
        every = np.ones(len(self.x), np.bool_)
        reach = self.reach(every)
        beyond = -side * (_inverse(self._normal(every)) @ (self.scores.sum(0) + self.stated * self.x))
        beyond = np.minimum(beyond, reach)
        return np.asarray(np.hypot(beyond, reach) - beyond)

    def following(self, bound: NDArray[np.bool_]) -> Float64:
        """Return how much each free unknown (free, bound) moves with one on its bound."""
        across = self.normals.sum(0)[np.ix_(~bound, bound)]
        return np.asarray(-_inverse(self._normal(~bound)) @ across)

    def _normal(self, free: NDArray[np.bool_]) -> Float64:
        normal = self.normals.sum(0)[np.ix_(free, free)]
        return np.asarray(normal + np.diag(self.stated[free] + _RIDGE + 1e-12 * np.diag(normal)))


def _slopes(residual: Residual, whole: Vector, left: Float64, unknowns: Sequence[Unknown]) -> Float64:
    """Return the Jacobian (n, unknowns) of a residual, second order, inside the box.

    `left` (n): the residual at `whole`.
    """

    def at(unknown: Unknown, x: float) -> Float64:
        return residual(moved(whole, [unknown], [x]))

    found = np.empty((len(left), len(unknowns)))
    for k, unknown in enumerate(unknowns):
        x, step = unknown.x_of(whole), unknown.step
        if unknown.low <= x - step and x + step <= unknown.high:
            found[:, k] = (at(unknown, x + step) - at(unknown, x - step)) / (2.0 * step)
        else:
            step = step if x + 2.0 * step <= unknown.high else -step
            found[:, k] = (4.0 * at(unknown, x + step) - at(unknown, x + 2.0 * step) - 3.0 * left) / (2.0 * step)
    return found


def _is_stated(unknown: Unknown) -> bool:
    """Tell whether an unknown's box is a stated tolerance, not an effect's range."""
    return (unknown.is_known or not _is_of_effect(unknown)) and unknown.low >= -SLACK and unknown.high <= SLACK


def _is_of_effect(unknown: Unknown) -> bool:
    return "." in unknown.name


def _inverse(normal: Float64) -> Float64:
    return np.asarray(np.linalg.pinv(normal, rcond=1e-13, hermitian=True))
