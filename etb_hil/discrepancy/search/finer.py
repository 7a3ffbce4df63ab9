"""Causes' own curves beside the plain ones that named them: a last model has their finer shapes, too."""

from __future__ import annotations

from collections.abc import Sequence

from etb_hil.discrepancy.fitting.calibration import Calibration, calibrate
from etb_hil.discrepancy.fitting.unknowns import finer_unknowns
from etb_hil.discrepancy.search.findings import Findings, Round

_ROUNDS = 20
_TOLERANCE = 2e-4  # of the cost: what is left to a shape is little to the rows, and much to a free run


def with_finer_shapes(findings: Findings, causes: Sequence[Round]) -> Calibration:
    """Return the final model with the finer shapes of some causes fitted, too, where they are not yet."""
    final, load = findings.final, findings.balances[0].load
    known = {unknown.name for unknown in final.unknowns}
    effects = [each.winner.candidate.effect for each in causes]
    finer = [unknown for effect in effects if effect is not None for unknown in finer_unknowns(effect, load)]
    more = [unknown for unknown in finer if unknown.name not in known]
    if not more:
        return final
    unknowns = [*final.unknowns, *more]
    return calibrate(findings.model, findings.balances, final.fit.whole, unknowns, _ROUNDS, tolerance=_TOLERANCE)
