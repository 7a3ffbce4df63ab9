"""The test that would settle what these data leave open: the scenario in which the class's members differ most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy import decision
from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.calibration import residual_of
from etb_hil.discrepancy.findings import Findings, Round
from etb_hil.discrepancy.fit import fit_of, gauss_newton
from etb_hil.discrepancy.floor import weigh
from etb_hil.discrepancy.planned import Plan, recorded
from etb_hil.discrepancy.refining import unknowns_of
from etb_hil.discrepancy.similarity import ABSORBED, ALIKE
from etb_hil.discrepancy.unknowns import Unknown
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector

Float64 = NDArray[np.float64]

UNIT = "standard deviations of the sensors' noise"
_MOST_RIVALS = 4
_ROUNDS = 2
_BASE = "parameter:"


@dataclass(frozen=True, slots=True)
class Parting:
    """How far a plan would part a cause from its rivals: `distances` by id over the noise, `parted` those it tells.

    `is_own`: no base parameters imitate the cause there.
    """

    plan: str
    distances: dict[str, float]
    parted: tuple[str, ...]
    is_own: bool

    @property
    def worth(self) -> tuple[bool, int, float]:
        """What plans are ranked by: the cause is its own, how many rivals are told apart, the shortest distance."""
        return self.is_own, len(self.parted), min(self.distances.values(), default=0.0)


def next_test(findings: Findings, plans: Sequence[Plan] = ()) -> dict[str, Any] | None:
    """Return the test for what is open; None where nothing is. Of the `plans` it takes the one that tells most.

    `separation_here` is by how much the rivals differ in these data, `expected_separation` what they would differ by.
    """
    if open_rounds := [r for r in findings.accepted if r.alike]:
        found = open_rounds[0]
        rivals = found.alike
    elif findings.verdict == "unexplained" and findings.rounds and len(findings.rounds[-1].refined) > 1:
        found = findings.rounds[-1]
        rivals = [found.refined[1].id]
    else:
        return None
    partings: list[Parting] = []
    if plans and not any(b.measured.is_drive for b in findings.balances):
        members = _members(found, rivals, findings.balances[0].load)
        partings = [_parting(plan, findings, found, members) for plan in plans]
    best = max(partings, key=lambda parting: parting.worth, default=None)
    if best is None or not best.parted:
        return _said(found, rivals[0], None)
    hardest = min(best.parted, key=lambda id_: best.distances[id_])
    return _said(found, hardest, best)


def _said(found: Round, rival: str, parting: Parting | None) -> dict[str, Any]:
    first = found.winner.id
    costs = {one.id: one.fit.cost for one in found.refined}
    away = float(np.sqrt(max(costs[rival] - costs[first], 0.0))) if rival in costs else None
    ways = [CATALOGUE[id_].separated_by for id_ in (first, rival) if id_ in CATALOGUE]
    says = "; or ".join(dict.fromkeys(ways)) or "state the parameter's tolerance more narrowly"
    expected = None
    if parting is not None:
        expected = {"value": parting.distances[rival], "unit": UNIT, "parts": list(parting.parted)}
    return {
        "pair": [first, rival],
        "says": says,
        "separation_here": away,
        "expected_separation": expected,
        "scenario": None if parting is None else parting.plan,
    }


@dataclass(frozen=True, slots=True)
class _Member:
    """What else the cause may be: where it was fitted, and what it may move."""

    id: str
    whole: Vector
    unknowns: list[Unknown]


def _members(found: Round, rivals: Sequence[str], load: float) -> list[_Member]:
    """Return the rivals that have a fit or a start of one; base parameters that only imitate together are one."""
    fitted = {one.id: one for one in found.refined}
    screened = {one.candidate.id: one for one in found.screened}
    base = found.before.unknowns
    members = []
    for id_ in rivals:
        if id_ in fitted:
            members.append(_Member(id_, fitted[id_].fit.whole, fitted[id_].unknowns))
        elif id_ in screened and not id_.startswith(_BASE):
            start = screened[id_].start
            members.append(_Member(id_, start, unknowns_of(base, screened[id_].candidate, start, load)))
    imitators = [id_ for id_ in rivals if id_.startswith(_BASE) and id_ not in fitted]
    if imitators:
        members.append(_Member(imitators[0], _without(found), [u.free() for u in base]))
    return members[:_MOST_RIVALS]


def _without(found: Round) -> Vector:
    """Return a round's fit with its winner taken out again, and no nuisance."""
    effect = found.winner.candidate.effect
    whole = (found.before if effect is None else found.winner).fit.whole.copy()
    whole[EXTENDED:] = 0.0
    if effect is not None:
        whole[[effect.indices[k] for k in effect.strengths]] = 0.0
    return whole


def _parting(plan: Plan, findings: Findings, found: Round, members: Sequence[_Member]) -> Parting:
    """Return how far the members are from the cause in a plan's record, each fitted to it anew."""
    truth = found.winner.fit.whole.copy()
    truth[EXTENDED:] = 0.0
    record: list[Balances] = [recorded(plan, findings.model, findings.balances[0], truth[:EXTENDED])]
    weigh(record, findings.final_floor.level)
    residual = residual_of(record)
    own = fit_of(residual, truth)
    start = fit_of(residual, _without(found))
    without, _ = gauss_newton(residual, start, found.before.unknowns, _ROUNDS)
    shown = max(without.cost - own.cost, 0.0)
    distances, parted = {}, []
    for member in members:
        whole = member.whole.copy()
        whole[EXTENDED:] = 0.0
        fit, _ = gauss_newton(residual, fit_of(residual, whole), member.unknowns, _ROUNDS)
        beyond = max(fit.cost - own.cost, 0.0)
        distances[member.id] = float(np.sqrt(beyond))
        # What is beside the rival, of what is beside the base: the sine of the angle between the two.
        least = ABSORBED**2 if member.id.startswith(_BASE) else 1.0 - ALIKE**2
        is_seen = np.log1p(beyond / own.cost) > decision.CLASS_MARGIN
        if is_seen and shown > 0.0 and beyond > least * shown:
            parted.append(member.id)
    is_own = True
    if found.winner.candidate.effect is not None:
        imitated, _ = gauss_newton(residual, start, [u.free() for u in found.before.unknowns], _ROUNDS)
        does = start.residual - own.residual
        is_own = imitated.cost - own.cost > ABSORBED**2 * float(does @ does)
    return Parting(plan.name, distances, tuple(parted), is_own)
