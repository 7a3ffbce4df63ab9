"""Nonlinear fits of candidates: strengths, shapes and base parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.candidates.candidate import Candidate
from etb_hil.discrepancy.candidates.screening import Screened
from etb_hil.discrepancy.fitting.calibration import Calibration
from etb_hil.discrepancy.fitting.fit import Fit, Residual, fit_of, gauss_newton
from etb_hil.discrepancy.fitting.unknowns import Unknown, effect_unknowns, finer_unknowns
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.physics import Vector

Float64 = NDArray[np.float64]

# Decision 0030. Rates by these thresholds: benchmarks/explain_study.py.
_QUICK_ITERATIONS = 3
_FULL_ITERATIONS = 6
LEAST_GAIN = 0.04  # of the residual, that a cause takes, and a second number beside the first
LEAST_BEYOND = 1.05  # tolerances off its nominal value that a parameter must be before it is a cause


@dataclass(frozen=True, slots=True)
class Refined:
    """A fitted candidate: its `unknowns`, base first, then its own."""

    candidate: Candidate
    fit: Fit
    unknowns: list[Unknown]

    @property
    def id(self) -> str:
        """The candidate's id."""
        return self.candidate.id


@dataclass(frozen=True, slots=True)
class Linearised(Refined):
    """A candidate while it is fitted: with the Jacobian (n, unknowns) at its end."""

    jacobian: Float64

    def refined(self) -> Refined:
        """Return it without its Jacobian, which would fill the memory."""
        return Refined(self.candidate, self.fit, self.unknowns)


def fit_quickly(residual: Residual, calibration: Calibration, screened: Screened, load: float = 1.0) -> Linearised:
    """Return a fitted candidate; the base model's Jacobian is kept, its own is fresh."""
    unknowns = unknowns_of(calibration.unknowns, screened.candidate, screened.start, load)
    # Where a parameter begins elsewhere, the base model's column of it says nothing.
    kept = calibration.jacobian if screened.candidate.begins is None else None
    best: tuple[Fit, Float64] | None = None
    for share in (1.0, 0.3):
        begin = fit_of(residual, _between(calibration.fit.whole, screened, share))
        found = gauss_newton(residual, begin, unknowns, _QUICK_ITERATIONS, kept)
        if best is None or found[0].cost < best[0].cost:
            best = found
        if screened.candidate.effect is None or best[0].cost < 1.1 * screened.cost:
            break  # it went where the linear model promised: another start is not needed
    assert best is not None  # noqa: S101 (two rounds at least)
    return Linearised(screened.candidate, best[0], unknowns, best[1])


def fit_fully(residual: Residual, refined: Linearised, iterations: int = _FULL_ITERATIONS) -> Linearised:
    """Return a candidate fitted to convergence, with no parameter more than it needs."""
    fit, jacobian = gauss_newton(residual, refined.fit, refined.unknowns, iterations, tolerance=1e-3)
    found = replace(refined, fit=fit, jacobian=jacobian)
    if not found.candidate.also_frees:
        return found
    alone = by_itself(residual, found, iterations)
    needs_both = _is_beyond(found) and alone.fit.cost * (1.0 - LEAST_GAIN) > found.fit.cost
    return found if needs_both else alone


def by_itself(residual: Residual, refined: Refined, iterations: int = _FULL_ITERATIONS) -> Linearised:
    """Return a parametric fault fitted alone, the jointly freed one in tolerance."""
    candidate, whole = refined.candidate, refined.fit.whole.copy()
    unknowns = [u.within_tolerance() if u.name == candidate.also_frees else u for u in refined.unknowns]
    for unknown in unknowns:
        if unknown.name == candidate.also_frees:
            unknown.put(whole, float(np.clip(unknown.x_of(whole), unknown.low, unknown.high)))
    fit, jacobian = gauss_newton(residual, fit_of(residual, whole), unknowns, iterations, tolerance=1e-3)
    return Linearised(replace(candidate, also_frees=""), fit, unknowns, jacobian)


def _is_beyond(refined: Linearised) -> bool:
    """Tell whether every freed parameter is beyond its tolerance."""
    freed = (u for u in refined.unknowns if u.name in refined.candidate.freed)
    return all(abs(u.x_of(refined.fit.whole)) > LEAST_BEYOND for u in freed)


def fit_finer_shapes(residual: Residual, refined: Linearised, load: float) -> Linearised:
    """Return a candidate with its effect's finer shapes, which a search leaves out."""
    effect = refined.candidate.effect
    if effect is None or not effect.finer:
        return refined
    found = fit_fully(residual, replace(refined, unknowns=[*refined.unknowns, *finer_unknowns(effect, load)]))
    return _farther(residual, found, effect)


def best_finer_shapes(residual: Residual, refined: Linearised, load: float) -> Linearised:
    """Return a plain effect with its best finer shapes, from several starts.

    The starts are the plain effect and either end of each shape: between curves that fit as well no gradient leads far.
    """
    effect = refined.candidate.effect
    if effect is None or not effect.finer:
        return refined
    finer = finer_unknowns(effect, load)
    unknowns = [*refined.unknowns, *finer]
    base = refined.jacobian[:, : len(refined.unknowns) - len(effect.parameters)]
    ended = [one for one, parameter in zip(finer, effect.finer, strict=True) if not parameter.elsewhere]
    begins = [refined.fit.whole.copy() for _ in range(1 + 2 * len(ended))]
    for k, one in enumerate(ended):
        one.put(begins[1 + 2 * k], one.low)
        one.put(begins[2 + 2 * k], one.high)
    tried = (gauss_newton(residual, fit_of(residual, whole), unknowns, _QUICK_ITERATIONS, base) for whole in begins)
    fit, jacobian = min(tried, key=lambda found: found[0].cost)
    return _farther(residual, fit_fully(residual, Linearised(refined.candidate, fit, unknowns, jacobian)), effect)


def _farther(residual: Residual, refined: Linearised, effect: Effect) -> Linearised:
    fit = elsewhere(residual, refined.fit, refined.jacobian, refined.unknowns, effect)
    return refined if fit is refined.fit else fit_fully(residual, replace(refined, fit=fit))


def elsewhere(residual: Residual, at: Fit, jacobian: Float64, unknowns: Sequence[Unknown], effect: Effect) -> Fit:
    """Return a fit, or a better one from other starts of an effect's finer shapes.

    `jacobian` (n, unknowns): that of the fit. Columns that are not the effect's own are kept.
    """
    finer = {f"{effect.id}.{parameter.name}": parameter for parameter in effect.finer}
    is_own = np.array([unknown.name.startswith(f"{effect.id}.") for unknown in unknowns])
    ordered = [unknowns[k] for k in np.argsort(is_own, kind="stable")]
    best = at
    for unknown in (each for each in unknowns if each.name in finer):
        parameter = finer[unknown.name]
        for value in parameter.elsewhere:
            whole = at.whole.copy()
            unknown.put(whole, value / parameter.scale)
            begin = fit_of(residual, whole)
            if begin.cost != at.cost:  # the record goes there
                found, _ = gauss_newton(residual, begin, ordered, _QUICK_ITERATIONS, jacobian[:, ~is_own])
                best = min(best, found, key=lambda fit: fit.cost)
    return best


def unknowns_of(base: Sequence[Unknown], candidate: Candidate, start: Vector, load: float) -> list[Unknown]:
    """Return the unknowns of a candidate's fit: base, freed ones, the effect's."""
    moved = [u.free() if u.name in candidate.freed else u for u in base]
    if candidate.effect is None:
        return moved
    shapes = [float(start[place]) for place in candidate.effect.indices]
    return moved + effect_unknowns(candidate.effect, shapes, load)


def _between(whole: Vector, screened: Screened, share: float) -> Vector:
    """Return the screened start with strengths and base steps scaled by a share."""
    start = whole + share * (screened.start - whole)
    effect = screened.candidate.effect
    if effect is not None:
        for place, parameter in zip(effect.indices, effect.parameters, strict=True):
            if not parameter.is_strength:
                start[place] = screened.start[place]
    return start
