"""The final model with the finer shapes of its causes."""

from __future__ import annotations

from collections.abc import Sequence

from etb_hil.discrepancy.candidates.refinement import elsewhere
from etb_hil.discrepancy.fitting.calibration import Calibration, calibrate, residual_of
from etb_hil.discrepancy.fitting.fit import Fit
from etb_hil.discrepancy.fitting.unknowns import Unknown, finer_unknowns
from etb_hil.discrepancy.search.findings import Findings, SelectionStep

_ITERATIONS = 20
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
        fit = elsewhere(residual_of(findings.balances), found.fit, found.jacobian, found.unknowns, effect)
        if fit is not found.fit:
            found = _fitted(findings, fit, found.unknowns)
    return found


def _fitted(findings: Findings, begin: Fit, unknowns: Sequence[Unknown]) -> Calibration:
    return calibrate(findings.model, findings.balances, begin.whole, unknowns, _ITERATIONS, tolerance=_TOLERANCE)
