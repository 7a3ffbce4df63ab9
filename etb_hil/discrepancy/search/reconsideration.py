"""Reconsideration of earlier causes beside a later one.

A cause that approximated two effects ranks before neither of them beside a later cause. A cause that only led base
parameters over a local minimum is dropped. Once all causes are accepted, a temperature is tested for friction that
still drifts (decision 0032).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.candidates.refinement import LEAST_GAIN
from etb_hil.discrepancy.fitting.box_least_squares import box_least_squares
from etb_hil.discrepancy.fitting.calibration import residual_of
from etb_hil.discrepancy.fitting.fit import fit_of
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.discrepancy.search.current_model import accept, continue_from, restore
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.discrepancy.search.finer_shapes import with_finer_shapes
from etb_hil.discrepancy.search.friction_drift import DRIFTS, WEARS, drifts, wears
from etb_hil.discrepancy.search.rejection import reason_to_reject
from etb_hil.discrepancy.search.selection import Progress, accepted_ids, selection_step
from etb_hil.plant.effects.port import Port
from etb_hil.plant.physics import Vector

# Decision 0030. Rates of pairs by these thresholds: benchmarks/explain_study.py, kind `pair`.
_NEAR = 2.0  # times what a cause left alone: a hypothesis that left no more may come before it beside a later one
IDLE = "recalibrated base parameters explain as much without it"
_RIDGE = 1e-3  # of what is measured nowhere
_CLEARLY = 0.5  # of what an earlier cause leaves: it stays unless another leaves less than that


def reconsider(findings: Findings, without: Sequence[str], progress: Progress) -> None:
    """Replace earlier causes that a near hypothesis clearly beats now.

    `without`: ids that are not tested.
    """
    *earlier, newest = findings.accepted
    uncertain = [old for old in earlier if _has_near_competitor(old)]
    replaced = [old for old in uncertain if try_replacement(findings, old, without, progress, is_wrong=False)]
    if replaced:  # the newest was found, and its ambiguity group made, beside a cause that is gone
        try_replacement(findings, newest, without, progress, is_wrong=True)


def try_replacement(
    findings: Findings, old: SelectionStep, without: Sequence[str], progress: Progress, *, is_wrong: bool
) -> bool:
    """Search in place of one cause, given all others; return whether it was replaced.

    `is_wrong`: the step has to be replaced, if only by the same cause fitted anew.
    """
    progress(f"testing again whether it is {old.winner.id}")
    current_model = findings.current_model
    old.accepted = False
    found = None
    try:
        continue_from(findings, *_less(findings, old))
        with_old = fit_of(residual_of(findings.balances), current_model.calibration.fit.whole).cost
        found = selection_step(findings, [*without, *accepted_ids(findings.accepted)], progress)
        is_better = found.winner.id != old.winner.id and found.winner.fit.cost < _CLEARLY * with_old
        if (is_better or is_wrong) and not reason_to_reject(found, findings):
            accept(findings, found)
            findings.selection_steps[findings.selection_steps.index(old)] = found
    finally:
        if found is None or not found.accepted:
            old.accepted = True
            restore(findings, current_model)
    return found.accepted


def drop_if_idle(findings: Findings, newest: SelectionStep) -> bool:
    """Drop the newest cause if base parameters now fit as well without it."""
    whole, unknowns = _less(findings, newest)
    final = findings.final
    left = fit_of(residual_of(findings.balances), whole)
    names = [u.name for u in unknowns]
    jacobian = final.jacobian[:, [u.name in names for u in final.unknowns]]
    x = np.array([u.x_of(whole) for u in unknowns])
    low, high = (np.array([getattr(u, side) for u in unknowns]) - x for side in ("low", "high"))
    normal = jacobian.T @ jacobian + _RIDGE * np.eye(len(x))
    moved = left.residual + jacobian @ box_least_squares(normal, -jacobian.T @ left.residual, low, high)
    if float(moved @ moved) * (1.0 - LEAST_GAIN) > final.fit.cost:
        return False
    newest.accepted, newest.rejection = False, IDLE
    continue_from(findings, whole, unknowns)
    if not findings.accepted:
        findings.start_here()
    return True


def consider_drift(findings: Findings) -> None:
    """Reject a temperature where friction drifts besides, or use explains as much.

    If it is the only cause it is dropped.
    """
    causes = findings.accepted
    for each in causes:
        effect = each.winner.candidate.effect
        if effect is None or not effect.acts_at(Port.FRICTION_HEAT):
            continue
        # What its finer shapes would take is no drift.
        if drifts(with_finer_shapes(findings, [each]), findings.balances, is_alone=len(causes) == 1):
            each.rejection = DRIFTS
        elif wears(findings.final.fit.whole, findings.calibration.fit.whole, findings.balances):
            each.rejection = WEARS
        if each.rejection and len(causes) == 1:
            continue_from(findings, *_less(findings, each))
            each.accepted = False


def _has_near_competitor(old: SelectionStep) -> bool:
    others = [competitor for competitor in old.refined[1:] if competitor.id not in old.ambiguity_group]
    return any(competitor.fit.cost < _NEAR * old.winner.fit.cost for competitor in others)


def _less(findings: Findings, old: SelectionStep) -> tuple[Vector, list[Unknown]]:
    """Return the whole vector, and the unknowns, without a cause."""
    whole, effect = findings.final.fit.whole.copy(), old.winner.candidate.effect
    healthy = {u.name: u for u in findings.calibration.unknowns}
    own = {u.name for u in old.winner.unknowns} - {u.name for u in old.before.unknowns}
    unknowns = [
        healthy[u.name] if u.name == old.winner.candidate.frees else u
        for u in findings.final.unknowns
        if u.name not in own
    ]
    if effect is not None:
        places = list(effect.stated_indices)
        whole[places] = findings.calibration.fit.whole[places]
    for unknown in unknowns:
        if unknown.name == old.winner.candidate.frees:
            unknown.put(whole, float(np.clip(unknown.x_of(whole), unknown.low, unknown.high)))
    return whole, unknowns
