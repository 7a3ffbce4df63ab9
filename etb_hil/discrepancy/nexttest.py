"""The test that would settle what these data leave open: the scenario whose record naming would leave least open in.

Plans are compared by the criterion that made the class; the best is then simulated with the cause in it and explained.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from etb_hil.discrepancy.calibration import calibrate, residual_of
from etb_hil.discrepancy.candidates import suspects
from etb_hil.discrepancy.findings import Findings, Round
from etb_hil.discrepancy.floor import weigh
from etb_hil.discrepancy.naming import search
from etb_hil.discrepancy.objections import LEAST_GAIN
from etb_hil.discrepancy.planned import Plan, recorded
from etb_hil.discrepancy.rivals import alike
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector

UNIT = "standard deviations of the sensors' noise"
_TRIED = 2  # plans that are explained before one is asked for
_WAYS = 3  # by hand, that are said


@dataclass(frozen=True, slots=True)
class Outlook:
    """What a plan's record would tell: `parted` of the cause's class it tells from the cause, `left` stays open.

    `left` may hold ids that were not in the class; `distances` by id over the noise, of rivals that were fitted.
    """

    plan: Plan
    parted: tuple[str, ...]
    left: tuple[str, ...]
    distances: dict[str, float]

    @property
    def worth(self) -> tuple[int, int, int]:
        """What plans are ranked by: how little stays open, how much is told apart, how short the test is."""
        return -len(self.left), len(self.parted), -len(self.plan.mode)


def next_test(findings: Findings, plans: Sequence[Plan] = ()) -> dict[str, Any] | None:
    """Return the test for what is open; None where nothing is. Of the `plans` it takes the one that leaves least open.

    `separation_here` is by how much a rival differs in these data; `expected_separation` by how much it would in the
    test, what the test would part from the cause, and what would stay open.
    """
    if open_rounds := [r for r in findings.accepted if r.alike]:
        found = open_rounds[0]
        rivals = found.alike
    elif findings.verdict == "unexplained" and findings.rounds and len(findings.rounds[-1].refined) > 1:
        found = findings.rounds[-1]
        rivals = [found.refined[1].id]
    else:
        return None
    best: Outlook | None = None
    if plans and not any(b.measured.is_drive for b in findings.balances):
        compared = [_compared(plan, findings, found, rivals) for plan in plans]
        for outlook in sorted(compared, key=lambda one: one.worth, reverse=True)[:_TRIED]:
            if best is not None and best.worth >= outlook.worth:
                break  # what was explained leaves no more open than what was only compared
            told = _explained(outlook.plan, findings, found, rivals)
            best = told if best is None or told.worth > best.worth else best
    return _said(found, rivals, best if best is not None and best.parted else None)


def _said(found: Round, rivals: Sequence[str], best: Outlook | None) -> dict[str, Any]:
    first = found.winner.id
    costs = {one.id: one.fit.cost for one in found.refined}
    # Whom the test parts least; where none does, or for those whom it does not, a hand has to.
    rival = rivals[0] if best is None else min(best.parted, key=lambda id_: best.distances.get(id_, np.inf))
    away = float(np.sqrt(max(costs[rival] - costs[first], 0.0))) if rival in costs else None
    expected = None
    if best is not None:
        value = best.distances.get(rival)
        expected = {"value": value, "unit": UNIT, "parts": list(best.parted), "leaves": list(best.left)}
    return {
        "pair": [first, rival],
        "says": _by_hand(first, rivals if best is None else best.left or [rival]),
        "separation_here": away,
        "expected_separation": expected,
        "scenario": None if best is None else best.plan.name,
    }


def _by_hand(first: str, others: Sequence[str]) -> str:
    ways = [CATALOGUE[id_].separated_by for id_ in (first, *others) if id_ in CATALOGUE]
    return "; or ".join([*dict.fromkeys(ways)][:_WAYS]) or "state the parameter's tolerance more narrowly"


def _compared(plan: Plan, findings: Findings, found: Round, rivals: Sequence[str]) -> Outlook:
    """Return what the criterion that made the class says of a plan's record without the cause."""
    healthy_whole, whole = _without(found), found.winner.fit.whole.copy()
    whole[EXTENDED:] = 0.0
    record = [recorded(plan, findings.model, findings.balances[0], healthy_whole[:EXTENDED])]
    weigh(record, findings.final_floor.level)
    healthy = calibrate(findings.model, record, healthy_whole, found.before.unknowns, rounds=1)
    residual = residual_of(record)
    does = residual(whole) - residual(healthy_whole)
    if float(does @ does) < LEAST_GAIN * healthy.fit.cost:
        return Outlook(plan, (), tuple(rivals), {})
    shapes = suspects(record, found.before.unknowns)
    members = [one for one in found.screened if one.candidate.id in rivals and one.candidate.id in shapes]
    names = alike(replace(found, screened=members, refined=[found.winner]), record, healthy, shapes)
    return _outlook(plan, rivals, [*names, *_unseen(rivals, shapes)], {})


def _unseen(rivals: Sequence[str], seen: Mapping[str, object]) -> list[str]:
    """Return the effects among some rivals that are no suspects in a record: it excludes none of them."""
    return [id_ for id_ in rivals if id_ in CATALOGUE and id_ not in seen]


def _outlook(plan: Plan, rivals: Sequence[str], left: Iterable[str], distances: dict[str, float]) -> Outlook:
    left = tuple(dict.fromkeys(left))
    return Outlook(plan, tuple(id_ for id_ in rivals if id_ not in left), left, distances)


def _without(found: Round) -> Vector:
    """Return a round's fit with its winner taken out again: no strength, or its parameter back in its box."""
    winner = found.winner
    whole = winner.fit.whole.copy()
    whole[EXTENDED:] = 0.0
    if winner.candidate.effect is not None:
        whole[list(winner.candidate.effect.stated_indices)] = 0.0
    for unknown in found.before.unknowns:
        if unknown.name == winner.candidate.frees:
            unknown.put(whole, float(np.clip(unknown.x_of(whole), unknown.low, unknown.high)))
    return whole


def _explained(plan: Plan, findings: Findings, found: Round, rivals: Sequence[str]) -> Outlook:
    """Return what naming says of a plan's record with the cause as it was found."""
    first = found.winner.id
    record = recorded(plan, findings.model, findings.balances[0], found.winner.fit.whole[:EXTENDED])
    told = search(findings.model, [record])
    if told.is_cut_short:
        raise KeyboardInterrupt  # a search ends with what it knows; what is known of a plan in part is nothing
    for named in told.accepted:
        ids = [named.winner.id, *named.alike]
        if first in ids:
            costs = {one.candidate.id: one.cost for one in named.screened} | {r.id: r.fit.cost for r in named.refined}
            away = {id_: float(np.sqrt(abs(cost - costs[first]))) for id_, cost in costs.items() if first in costs}
            left = [id_ for id_ in ids if id_ != first]
            return _outlook(plan, rivals, [*left, *_unseen(rivals, suspects([record], found.before.unknowns))], away)
    return Outlook(plan, (), tuple(rivals), {})
