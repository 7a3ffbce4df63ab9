"""Causes asked again: beside a later one what stood in for two effects has no rank against either of them.

What only led base parameters over a hill is none.

And a temperature asked, once all causes are in, whether friction still drifts beside it (decision 0032).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.fitting.boxed import boxed
from etb_hil.discrepancy.fitting.calibration import residual_of
from etb_hil.discrepancy.fitting.fit import fit_of
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.discrepancy.search.drifting import DRIFTS, WEARS, drifts, wears
from etb_hil.discrepancy.search.findings import Findings, Round
from etb_hil.discrepancy.search.finer import with_finer_shapes
from etb_hil.discrepancy.search.objections import objection
from etb_hil.discrepancy.search.rounds import Progress, one_round, taken_by
from etb_hil.discrepancy.search.standing import go_back, settle, take_in
from etb_hil.discrepancy.suspects.refining import LEAST_GAIN
from etb_hil.plant.effects.port import Port
from etb_hil.plant.physics import Vector

# Decision 0030. Rates of pairs by these thresholds: benchmarks/explain_study.py, kind `pair`.
_NEAR = 2.0  # times what a cause left alone: a hypothesis that left no more may come before it beside a later one
IDLE = "base parameters leave as little without it, once it has moved them"
_RIDGE = 1e-3  # of what is measured nowhere
_CLEARLY = 0.5  # of what an earlier cause leaves: it stays unless another leaves less than that


def ask_again(findings: Findings, without: Sequence[str], progress: Progress) -> None:
    """Replace earlier causes that a near hypothesis beats clearly now; `without`: ids that are no candidates."""
    *earlier, newest = findings.accepted
    doubtful = [old for old in earlier if _has_near_rival(old)]
    replaced = [old for old in doubtful if is_replaced(findings, old, without, progress, is_wrong=False)]
    if replaced:  # the newest was found, and its class made, beside a cause that is gone
        is_replaced(findings, newest, without, progress, is_wrong=True)


def is_replaced(findings: Findings, old: Round, without: Sequence[str], progress: Progress, *, is_wrong: bool) -> bool:
    """Search in place of one cause, all others taken in; return whether another round has come in its place.

    `is_wrong`: the round as it is has to be replaced, if only by the same cause seen anew.
    """
    progress(f"asking again whether it is {old.winner.id}")
    standing = findings.standing
    old.accepted = False
    found = None
    try:
        settle(findings, *_less(findings, old))
        with_old = fit_of(residual_of(findings.balances), standing.calibration.fit.whole).cost
        found = one_round(findings, [*without, *taken_by(findings.accepted)], progress)
        is_better = found.winner.id != old.winner.id and found.winner.fit.cost < _CLEARLY * with_old
        if (is_better or is_wrong) and not objection(found, findings):
            take_in(findings, found)
            findings.rounds[findings.rounds.index(old)] = found
    finally:
        if found is None or not found.accepted:
            old.accepted = True
            go_back(findings, standing)
    return found.accepted


def is_given_up(findings: Findings, newest: Round) -> bool:
    """Take the newest cause out again where base parameters, once it has moved them, leave as little without it."""
    whole, unknowns = _less(findings, newest)
    final = findings.final
    left = fit_of(residual_of(findings.balances), whole)
    names = [u.name for u in unknowns]
    columns = final.columns[:, [u.name in names for u in final.unknowns]]
    x = np.array([u.x_of(whole) for u in unknowns])
    low, high = (np.array([getattr(u, side) for u in unknowns]) - x for side in ("low", "high"))
    normal = columns.T @ columns + _RIDGE * np.eye(len(x))
    moved = left.residual + columns @ boxed(normal, -columns.T @ left.residual, low, high)
    if float(moved @ moved) * (1.0 - LEAST_GAIN) > final.fit.cost:
        return False
    newest.accepted, newest.refused = False, IDLE
    settle(findings, whole, unknowns)
    if not findings.accepted:
        findings.start_here()
    return True


def doubt_drifts(findings: Findings) -> None:
    """Object to a temperature beside which friction drifts, or that use does as well; alone it is no cause then."""
    causes = findings.accepted
    for each in causes:
        effect = each.winner.candidate.effect
        if effect is None or not effect.acts_at(Port.FRICTION_HEAT):
            continue
        # What its finer shapes would take is no drift.
        if drifts(with_finer_shapes(findings, [each]), findings.balances, is_alone=len(causes) == 1):
            each.refused = DRIFTS
        elif wears(findings.final.fit.whole, findings.calibration.fit.whole, findings.balances):
            each.refused = WEARS
        if each.refused and len(causes) == 1:
            settle(findings, *_less(findings, each))
            each.accepted = False


def _has_near_rival(old: Round) -> bool:
    others = [rival for rival in old.refined[1:] if rival.id not in old.alike]
    return any(rival.fit.cost < _NEAR * old.winner.fit.cost for rival in others)


def _less(findings: Findings, old: Round) -> tuple[Vector, list[Unknown]]:
    """Return the whole vector, and what is fitted, without a cause."""
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
