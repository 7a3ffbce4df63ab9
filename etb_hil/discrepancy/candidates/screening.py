"""Screening: a linear test of every candidate at physical steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.side_by_side import side_by_side
from etb_hil.discrepancy.candidates.candidate import Candidate
from etb_hil.discrepancy.fitting.box_least_squares import box_least_squares
from etb_hil.discrepancy.fitting.calibration import Calibration
from etb_hil.discrepancy.fitting.fit import Fit, Residual, fit_of, jacobian
from etb_hil.plant.physics import Vector

Float64 = NDArray[np.float64]

_RIDGE = 1e-3
_REACH = 0.004  # rad about where a stop's fit begins that its slope leads


@dataclass(frozen=True, slots=True)
class Screened:
    """A candidate's best shape: the predicted cost, and the vector to start from.

    Its Jacobian is dropped: those of some thirty candidates would fill the memory.
    """

    candidate: Candidate
    cost: float
    start: Vector


@dataclass(frozen=True, slots=True)
class Linear:
    """The calibrated base model linearised: normal equations and boxes."""

    calibration: Calibration
    normal: Float64
    right: Float64
    low: Float64
    high: Float64
    x: Float64

    @staticmethod
    def of(calibration: Calibration) -> Linear:
        """Return the normal equations of a calibration."""
        jacobian, fit = calibration.jacobian, calibration.fit
        x = np.array([u.x_of(fit.whole) for u in calibration.unknowns])
        low = np.array([u.low for u in calibration.unknowns])
        high = np.array([u.high for u in calibration.unknowns])
        normal = jacobian.T @ jacobian + _RIDGE * np.eye(len(x))
        right = -(jacobian.T @ fit.residual)
        return Linear(calibration, normal, right, low, high, np.clip(x, low, high))


def screen(
    residual: Residual,
    linear: Linear,
    candidates: Mapping[str, Sequence[Candidate]],
    progress: Callable[[str], None] = lambda _: None,
) -> list[Screened]:
    """Return each candidate's best shape, the most promising first."""

    def best(shapes: Sequence[Candidate]) -> Screened:
        return min(side_by_side(lambda one: _tried(residual, linear, one), shapes), key=lambda tried: tried.cost)

    progress("the candidates")
    found = []
    for id_, one in zip(candidates, side_by_side(best, candidates.values()), strict=True):
        progress(id_)
        found.append(one)
    return sorted(found, key=lambda s: s.cost)


def shaped(fit: Fit, candidate: Candidate) -> Vector:
    """Return a fit's whole vector with the shapes of a candidate, strengths unchanged."""
    effect = candidate.effect
    assert effect is not None  # noqa: S101 (parameters have no shape)
    base = fit.whole.copy()
    for unknown, value, parameter in zip(candidate.unknowns, candidate.shape, effect.parameters, strict=True):
        if not parameter.is_strength:
            base[unknown.place] = value
    return base


def stepped(residual: Residual, fit: Fit, candidate: Candidate) -> Float64:
    """Return the sensitivity of a residual (n, strengths) to each searched strength."""
    base = shaped(fit, candidate)
    found = []
    for unknown, step in zip(candidate.strengths, candidate.steps, strict=True):
        moved = base.copy()
        moved[unknown.place] += step
        found.append((residual(moved) - fit.residual) * (unknown.scale / step))
    return np.column_stack(found)


def _tried(residual: Residual, linear: Linear, candidate: Candidate) -> Screened:
    if candidate.frees:
        return _freed(residual, linear, candidate)
    calibration = linear.calibration
    fit = calibration.fit
    base = shaped(fit, candidate)
    raw = stepped(residual, fit, candidate)
    count = raw.shape[1]
    cross = calibration.jacobian.T @ raw
    own = raw.T @ raw
    normal = np.block([[linear.normal, cross], [cross.T, own + (_RIDGE + 1e-9 * np.trace(own)) * np.eye(count)]])
    right = np.concatenate([linear.right, -raw.T @ fit.residual])
    there = np.array([unknown.x_of(base) for unknown in candidate.strengths])  # what the model file states of heat
    low = np.concatenate([linear.low - linear.x, [u.low for u in candidate.strengths] - there])
    high = np.concatenate([linear.high - linear.x, [u.high for u in candidate.strengths] - there])
    x = box_least_squares(normal, right, low, high)
    cost = fit.cost + float(x @ normal @ x) - 2.0 * float(right @ x)
    start = base.copy()
    for unknown, value in zip(calibration.unknowns, linear.x + x[:-count], strict=True):
        unknown.put(start, value)
    for unknown, value in zip(candidate.strengths, there + x[-count:], strict=True):
        unknown.put(start, value)
    return Screened(candidate, cost, start)


def _freed(residual: Residual, linear: Linear, candidate: Candidate) -> Screened:
    places = [k for k, u in enumerate(linear.calibration.unknowns) if u.name in candidate.freed]
    if candidate.begins is not None:
        linear = Linear.of(_begun(residual, linear.calibration, places[0], candidate.begins))
    calibration = linear.calibration
    low, high = linear.low - linear.x, linear.high - linear.x
    for index in places if candidate.begins is None else ():
        free = calibration.unknowns[index].free()
        low[index], high[index] = free.low - linear.x[index], free.high - linear.x[index]
    x = box_least_squares(linear.normal, linear.right, low, high)
    cost = calibration.fit.cost + float(x @ linear.normal @ x) - 2.0 * float(linear.right @ x)
    start = calibration.fit.whole.copy()
    for unknown, value in zip(calibration.unknowns, linear.x + x, strict=True):
        unknown.put(start, value)
    return Screened(candidate, cost, start)


def _begun(residual: Residual, calibration: Calibration, index: int, begins: float) -> Calibration:
    """Return a calibration with one stop at `begins` (rad), and its column from there."""
    unknowns, whole, there = list(calibration.unknowns), calibration.fit.whole.copy(), calibration.jacobian.copy()
    x = (begins - unknowns[index].centre) / unknowns[index].scale
    reach = _REACH / unknowns[index].scale
    moved = unknowns[index] = replace(unknowns[index], low=x - reach, high=x + reach)
    moved.put(whole, x)
    fit = fit_of(residual, whole)
    there[:, index] = jacobian(residual, fit, [moved])[:, 0]
    return Calibration(unknowns, fit, there)
