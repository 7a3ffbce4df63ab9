"""Damped Gauss-Newton in a box, on normal equations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.base.side_by_side import side_by_side
from etb_hil.discrepancy.fitting.unknowns import Unknown, box_of, moved
from etb_hil.plant.physics import COULOMB, STICTION, Vector
from etb_hil.recording.samples import Float64

Residual = Callable[[Vector], Float64]

_RIDGE = 1e-3  # ridge on the scaled unknowns, for directions that no sample determines; in squared residuals
TOLERANCE = 2e-3  # relative decrease of the cost: the fit ends at an iteration that gains less
_TRIES = 6
_MOST = 200  # iterations of the least squares in a box
_TRUST = 0.2  # relative error of a step's predicted gain up to which its Jacobian is used again


@dataclass(frozen=True, slots=True)
class Fit:
    """The end of a fit: the whole vector, the residual (n) and its sum of squares."""

    whole: Vector
    residual: Float64
    cost: float


def jacobian(residual: Residual, at: Fit, unknowns: Sequence[Unknown]) -> Float64:
    """Return the residual's Jacobian (n, unknowns) by differences inside the box."""
    found = np.empty((len(at.residual), len(unknowns)))

    def fill(k: int) -> None:
        unknown = unknowns[k]
        x = unknown.x_of(at.whole)
        step = unknown.step if x + unknown.step <= unknown.high else -unknown.step
        found[:, k] = (residual(moved(at.whole, [unknown], [x + step])) - at.residual) / step

    for _ in side_by_side(fill, range(len(unknowns))):
        pass
    return found


def fit_of(residual: Residual, whole: Vector) -> Fit:
    """Return the residual at a point; infinite cost if the model cannot be computed."""
    left = residual(whole)
    cost = float(left @ left)
    return Fit(whole, left, cost if np.isfinite(cost) else np.inf)


def gauss_newton(
    residual: Residual,
    begin: Fit,
    unknowns: Sequence[Unknown],
    iterations: int,
    kept: Float64 | None = None,
    tolerance: float = TOLERANCE,
) -> tuple[Fit, Float64]:
    """Return the fit after some iterations, and its last Jacobian (n, unknowns).

    `kept`: columns of the first unknowns that stay as they are, so that only the others are differenced. A Jacobian is
    kept until a step gains other than it predicted. The iteration stops where one with a fresh Jacobian gains less than
    a share `tolerance`.
    """
    found = np.zeros((len(begin.residual), len(unknowns)))
    if not np.isfinite(begin.cost):
        return begin, found
    if kept is not None:
        found[:, : kept.shape[1]] = kept
    known = 0 if kept is None else kept.shape[1]
    at = _descended(residual, begin, unknowns, iterations, found, known, tolerance)
    raised = _with_peak(residual, at, unknowns) if kept is None else at
    if raised is not at:
        jacobian_there = np.empty_like(found)
        again = _descended(residual, raised, unknowns, iterations, jacobian_there, 0, tolerance)
        if again.cost < at.cost:
            return again, jacobian_there
    return at, found


def _descended(
    residual: Residual,
    begin: Fit,
    unknowns: Sequence[Unknown],
    iterations: int,
    found: Float64,
    known: int,
    tolerance: float,
) -> Fit:
    """Return the fit after some iterations; `found` (n, unknowns) gets its Jacobian.

    Its first `known` columns stay.
    """
    at, damping, is_fresh, is_trusted = begin, 1e-4, False, False
    normal = np.empty((0, 0))
    for _ in range(iterations):
        if not is_trusted:
            found[:, known:] = jacobian(residual, at, unknowns[known:])
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
    """Return a fit with break-away friction raised above sliding friction.

    Below it there is no Stribeck peak, and so no gradient: a fit that came there stays.
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
    """Return the fit after one step, its damping, and whether it gained as predicted."""
    low, high = box_of(unknowns)
    x = np.clip([u.x_of(at.whole) for u in unknowns], low, high)
    for _ in range(_TRIES):
        step = box_least_squares(normal + np.diag(damping * np.diag(normal) + _RIDGE), right, low - x, high - x)
        tried = fit_of(residual, moved(at.whole, unknowns, x + step))
        if tried.cost < at.cost:
            predicted = 2.0 * float(right @ step) - float(step @ normal @ step)
            is_as_predicted = abs(at.cost - tried.cost - predicted) < _TRUST * predicted
            return tried, max(damping * 0.1, 1e-6), is_as_predicted
        damping = max(damping * 10.0, 1e-3)
    return at, damping, False


def box_least_squares(normal: Float64, right: Float64, low: Float64, high: Float64) -> Float64:
    """Return x (n) that minimises x' A x / 2 - b' x with low <= x <= high.

    By a projected Newton method with an active set. `normal` A (n, n) is positive definite, `right` b (n). The box need
    not contain 0.
    """
    x = np.clip(np.zeros(len(right)), low, high)
    free = np.ones(len(right), bool)
    for _ in range(_MOST):
        target = x.copy()
        if free.any():
            rest = right[free] - normal[np.ix_(free, ~free)] @ x[~free]
            target[free] = np.linalg.solve(normal[np.ix_(free, free)], rest)
        step = target - x
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(step > 0.0, (high - x) / step, np.where(step < 0.0, (low - x) / step, np.inf))
        ratio[~free] = np.inf
        reach = float(ratio.min(initial=np.inf))
        if reach < 1.0:
            hit = int(np.argmin(ratio))
            x = x + max(reach, 0.0) * step
            x[hit] = high[hit] if step[hit] > 0.0 else low[hit]
            free[hit] = False
            continue
        x = target
        slope = normal @ x - right  # a bound holds only what pushes against it
        scale = 1e-9 * (np.abs(right) + np.abs(normal) @ np.abs(x)) + 1e-300
        wrong = ~free & (high > low) & np.where(x >= high, slope > scale, slope < -scale)
        if not wrong.any():
            break
        free[int(np.argmax(np.where(wrong, np.abs(slope) / scale, 0.0)))] = True
    return x
