"""Gauss-Newton in a box: damped, its normal equations summed once a linearisation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.side_by_side import side_by_side
from etb_hil.discrepancy.fitting.boxed import boxed
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.plant.physics import COULOMB, STICTION, Vector

Float64 = NDArray[np.float64]
Residual = Callable[[Vector], Float64]

_RIDGE = 1e-3  # of what is measured nowhere; in squared residuals a scaled unit
TOLERANCE = 2e-3  # of the cost: a round that gains less is the last
_TRIES = 6
_TRUST = 0.2  # of what a step was to gain: within it the columns that promised it still hold


@dataclass(frozen=True, slots=True)
class Fit:
    """Where a fit ended: the whole vector, the residual (n) and its sum of squares there."""

    whole: Vector
    residual: Float64
    cost: float


def columns(residual: Residual, at: Fit, unknowns: Sequence[Unknown]) -> Float64:
    """Return the residual's derivatives (n, unknowns) by differences, each into the box."""
    found = np.empty((len(at.residual), len(unknowns)))

    def fill(k: int) -> None:
        unknown = unknowns[k]
        x = unknown.x_of(at.whole)
        step = unknown.step if x + unknown.step <= unknown.high else -unknown.step
        moved = at.whole.copy()
        unknown.put(moved, x + step)
        found[:, k] = (residual(moved) - at.residual) / step

    for _ in side_by_side(fill, range(len(unknowns))):
        pass
    return found


def fit_of(residual: Residual, whole: Vector) -> Fit:
    """Return the residual at a point; where the model cannot be computed, at endless cost."""
    left = residual(whole)
    cost = float(left @ left)
    return Fit(whole, left, cost if np.isfinite(cost) else np.inf)


def gauss_newton(
    residual: Residual,
    begin: Fit,
    unknowns: Sequence[Unknown],
    rounds: int,
    kept: Float64 | None = None,
    tolerance: float = TOLERANCE,
    first: Float64 | None = None,
) -> tuple[Fit, Float64]:
    """Return the fit after some rounds, and the last columns (n, unknowns).

    `kept`: columns of the first unknowns that are taken as they are throughout, so that only the others are
    differenced. `first`: columns to begin with, from somewhere near. Columns serve until a step gains other than they
    promised. It stops where a round with fresh ones gains less than a share `tolerance`.
    """
    found = np.zeros((len(begin.residual), len(unknowns)))
    if not np.isfinite(begin.cost):
        return begin, found
    if kept is not None:
        found[:, : kept.shape[1]] = kept
    if first is not None:
        found[:] = first
    known = 0 if kept is None else kept.shape[1]
    at = _descended(residual, begin, unknowns, rounds, found, known, tolerance, is_trusted=first is not None)
    raised = _with_peak(residual, at, unknowns) if kept is None else at
    if raised is not at:
        columns_there = np.empty_like(found)
        again = _descended(residual, raised, unknowns, rounds, columns_there, 0, tolerance, is_trusted=False)
        if again.cost < at.cost:
            return again, columns_there
    return at, found


def _descended(
    residual: Residual,
    begin: Fit,
    unknowns: Sequence[Unknown],
    rounds: int,
    found: Float64,
    known: int,
    tolerance: float,
    *,
    is_trusted: bool,
) -> Fit:
    """Return the fit after some rounds; `found` (n, unknowns) has the last columns, the first `known` as they came."""
    at, damping, is_fresh = begin, 1e-4, False
    normal = found.T @ found if is_trusted else np.empty((0, 0))
    for _ in range(rounds):
        if not is_trusted:
            found[:, known:] = columns(residual, at, unknowns[known:])
            normal = found.T @ found
            is_fresh = True
        before = at.cost
        at, damping, kept_word = _step(residual, at, unknowns, normal, -(found.T @ at.residual), damping)
        if 1.0 - at.cost / before >= tolerance:
            is_fresh, is_trusted = False, kept_word
        elif is_fresh:
            break  # the last columns are from next to where it ended
        else:
            is_trusted = False
    return at


def _with_peak(residual: Residual, at: Fit, unknowns: Sequence[Unknown]) -> Fit:
    """Return a fit whose break-away friction is put above sliding friction where it was not, or the fit itself.

    Below it there is no peak, which would give it a slope, and the Stribeck velocity one: a fit that came there stays.
    """
    whole = at.whole.copy()
    for unknown in unknowns:
        if unknown.place == STICTION and whole[STICTION] <= whole[COULOMB]:
            # Beyond what differences step over: on the edge itself they would see one side of it only.
            level = (whole[COULOMB] - unknown.centre) / unknown.scale + 2.0 * unknown.step
            unknown.put(whole, float(min(max(level, unknown.low), unknown.high)))
    return at if np.array_equal(whole, at.whole) else fit_of(residual, whole)


def _step(
    residual: Residual, at: Fit, unknowns: Sequence[Unknown], normal: Float64, right: Float64, damping: float
) -> tuple[Fit, float, bool]:
    """Return the fit after one step that gains, the damping that it took, and whether it gained what it promised."""
    low = np.array([u.low for u in unknowns])
    high = np.array([u.high for u in unknowns])
    x = np.clip([u.x_of(at.whole) for u in unknowns], low, high)
    for _ in range(_TRIES):
        step = boxed(normal + np.diag(damping * np.diag(normal) + _RIDGE), right, low - x, high - x)
        moved = at.whole.copy()
        for unknown, value in zip(unknowns, x + step, strict=True):
            unknown.put(moved, value)
        tried = fit_of(residual, moved)
        if tried.cost < at.cost:
            promised = 2.0 * float(right @ step) - float(step @ normal @ step)
            kept_word = abs(at.cost - tried.cost - promised) < _TRUST * promised
            return tried, max(damping * 0.1, 1e-6), kept_word
        damping = max(damping * 10.0, 1e-3)
    return at, damping, False
