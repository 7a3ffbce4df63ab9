"""Nonlinear fits of candidates: strengths, shapes and base parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.discrepancy.candidates.candidate import Candidate
from etb_hil.discrepancy.fitting.fit import Fit, Residual, fit_of, gauss_newton
from etb_hil.discrepancy.fitting.unknowns import Unknown, effect_unknowns
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.physics import Vector
from etb_hil.recording.samples import Float64

_QUICK_ITERATIONS = 3


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
