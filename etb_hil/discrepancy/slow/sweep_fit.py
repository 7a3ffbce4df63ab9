"""Parameters fitted to free runs by the measured voltage alone.

Free runs from a poor start end in local minima. Pulled a little towards the measured angle at every sample, then less,
then not at all, they do not; and they begin from more than one point.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.discrepancy.fitting.fit import Fit, fit_of, gauss_newton
from etb_hil.discrepancy.fitting.unknowns import Unknown, simulable
from etb_hil.discrepancy.slow.sweeps import Sweep
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector
from etb_hil.recording.samples import Float64

# Decision 0029. A published throttle by these: benchmarks/explain_tbcp.py.
_LEAST = 0.005  # of what a model file states: what cannot be negative stays above it
_PULLS = (0.1, 0.03, 0.0)
_DRAWN_ITERATIONS, _ITERATIONS = 6, 15
_LATE = (0.0, 0.5, 1.0, 1.5)  # samples
_STARTS = (0.6, 1.6)  # times what the model file states of friction and springs, beside that itself
_SCALED = ("coulomb", "stiction", "viscous", "slope_open", "slope_close", "preload_close")
_WEIGHT = 100.0  # residuals are of the order of one


@dataclass(frozen=True, slots=True)
class SweepFit:
    """The best fit with its Jacobian (n, unknowns), and rms errors (rad) by start.

    `late`: ticks by which the voltage acts later than its sample.
    """

    whole: Vector
    unknowns: list[Unknown]
    jacobian: Float64
    residual: Float64
    late: int
    ends: tuple[float, ...]


def fit_sweeps(
    runs: Sequence[Sweep], begin: Vector, unknowns: Sequence[Unknown], progress: Callable[[str], None] = lambda _: None
) -> SweepFit:
    """Fit unknowns and the lateness of the voltage to free runs."""
    fitted = [_above_zero(u) for u in unknowns]
    progress("fitting free runs: when the voltage acts")
    drawn = [_drawn(runs, begin, fitted, late) for late in (round(samples * runs[0].step) for samples in _LATE)]
    first, late = min(drawn, key=lambda one: one[0].cost)
    tried = []
    for number in range(len(_STARTS) + 1):
        progress(f"fitting free runs: start {number + 1} of {len(_STARTS) + 1}")
        at = first.whole if number == 0 else _elsewhere(runs, begin, fitted, late, _STARTS[number - 1])
        for pull in _PULLS[1:]:
            residual = _residual(runs, pull, late)
            fit, jacobian = gauss_newton(residual, fit_of(residual, at), fitted, _ITERATIONS)
            at = fit.whole
        tried.append((fit, jacobian))
    fit, jacobian = min(tried, key=lambda one: one[0].cost)
    ends = tuple(float(np.sqrt(one.cost / len(one.residual))) / _WEIGHT for one, _ in tried)
    return SweepFit(simulable(fit.whole), fitted, jacobian / _WEIGHT, fit.residual / _WEIGHT, late, ends)


def _elsewhere(runs: Sequence[Sweep], begin: Vector, unknowns: list[Unknown], late: int, scale: float) -> Vector:
    """Return the end of a pulled fit that starts with scaled friction and springs."""
    at = begin.copy()
    for u in unknowns:
        if u.name in _SCALED:
            u.put(at, float(np.clip(u.x_of(begin * scale), u.low, u.high)))
    return _drawn(runs, at, unknowns, late)[0].whole


def _drawn(runs: Sequence[Sweep], at: Vector, unknowns: list[Unknown], late: int) -> tuple[Fit, int]:
    residual = _residual(runs, _PULLS[0], late)
    return gauss_newton(residual, fit_of(residual, at), unknowns, _DRAWN_ITERATIONS)[0], late


def _above_zero(unknown: Unknown) -> Unknown:
    """Return it with a box that keeps a positive parameter positive."""
    if unknown.centre <= 0.0:
        return unknown
    return replace(unknown, low=max(unknown.low, (_LEAST - 1.0) * unknown.centre / unknown.scale))


def _residual(runs: Sequence[Sweep], pull: float, late: int) -> Callable[[Vector], Float64]:
    def residual(whole: Vector) -> Float64:
        p = simulable(whole)[:EXTENDED]
        parts = [r.simulated(p, first=r.first, pull=pull, late=late) - r.angle[r.first :] for r in runs]
        return np.concatenate(parts) * _WEIGHT

    return residual
