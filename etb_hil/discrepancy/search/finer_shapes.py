"""The final model with the finer shapes of its causes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.fitting.calibration import Calibration, calibrate, residual_of
from etb_hil.discrepancy.fitting.fit import Fit, Residual, fit_of, gauss_newton
from etb_hil.discrepancy.fitting.unknowns import Unknown, finer_unknowns, moved
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.plant.effects.effect import Effect
from etb_hil.recording.samples import Float64

_ITERATIONS = 20
_QUICK_ITERATIONS = 3  # from another start of a shape
_TOLERANCE = 2e-4  # of the cost: an error of a shape changes the samples little, and a free run much


def with_finer_shapes(findings: Findings, causes: Sequence[SelectionStep]) -> Calibration:
    """Return the final model with the finer shapes of some causes fitted, too."""
    final, load = findings.final, findings.balances[0].load
    known = {unknown.name for unknown in final.unknowns}
    effects = [effect for each in causes if (effect := each.winner.candidate.effect) is not None]
    finer = [unknown for effect in effects for unknown in finer_unknowns(effect, load)]
    more = [unknown for unknown in finer if unknown.name not in known]
    if not more:
        return final
    found = _fitted(findings, final.fit, [*final.unknowns, *more])
    for effect in effects:
        fit = _elsewhere(residual_of(findings.balances), found.fit, found.jacobian, found.unknowns, effect)
        if fit is not found.fit:
            found = _fitted(findings, fit, found.unknowns)
    return found


def _fitted(findings: Findings, begin: Fit, unknowns: Sequence[Unknown]) -> Calibration:
    return calibrate(findings.model, findings.balances, begin.whole, unknowns, _ITERATIONS, tolerance=_TOLERANCE)


def _elsewhere(residual: Residual, at: Fit, jacobian: Float64, unknowns: Sequence[Unknown], effect: Effect) -> Fit:
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
            begin = fit_of(residual, moved(at.whole, [unknown], [value / parameter.scale]))
            if begin.cost != at.cost:  # the record goes there
                found, _ = gauss_newton(residual, begin, ordered, _QUICK_ITERATIONS, jacobian[:, ~is_own])
                best = min(best, found, key=lambda fit: fit.cost)
    return best
