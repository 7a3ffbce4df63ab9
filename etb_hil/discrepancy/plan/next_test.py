"""The next test: the scenario whose record would isolate most.

Each plan is simulated with the cause as the truth. The information of its record tells which members of the ambiguity
group it would exclude. The record of the best plan is explained, once with the cause as the truth and once with the
likeliest other member.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from etb_hil.base.side_by_side import side_by_side
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.plan.bench_measurements import BenchPlan, plan_bench_measurements
from etb_hil.discrepancy.plan.planned import Plan, recorded
from etb_hil.discrepancy.plan.prospects import Left, Truth, expected_beside, left_beside, members
from etb_hil.discrepancy.search.findings import Compared, Findings, SelectionStep
from etb_hil.hypotheses.constants import GAIN
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.parameters import Model
from etb_hil.plant.table_one import Shaft
from etb_hil.results.explained.next_test import BenchStep, NextTest, RequiredParameter, Separation

UNIT = "standard deviations of the sensors' noise"
_WAYS = 3  # at the bench, that are said
_EXCLUDES = float(np.sqrt(2.0 * GAIN))  # standard deviations: what is nearer is not excluded, whatever its misfit
_LIKELY = 0.5  # of the misfit, that a candidate leaves at most for a test of it to be worth a run


@dataclass(frozen=True, slots=True)
class Outlook:
    """Prospects of a plan: `parted` of the ambiguity group it isolates, `left` remain.

    `left` may hold ids that these data could not judge; `shows`: the cause over the noise, in standard deviations;
    `distances` by id, likewise, of competing hypotheses that were fitted.
    """

    plan: Plan
    parted: tuple[str, ...]
    left: tuple[str, ...]
    shows: float
    distances: dict[str, float] = field(default_factory=dict)

    @property
    def isolates(self) -> tuple[int, int]:
        """How little stays open, and how much is isolated."""
        return -len(self.left), len(self.parted)

    @property
    def worth(self) -> tuple[int, int, float]:
        """The rank of a plan: how little remains, how much is isolated, how well it shows."""
        return *self.isolates, self.shows


def next_test(
    findings: Findings, plans: Sequence[Plan] = (), progress: Callable[[str], None] = lambda _: None
) -> NextTest | None:
    """Return the next test; None if nothing is ambiguous or no candidate comes near.

    Of the `plans` it takes the one that leaves least ambiguous. `separation_here` is by how much a competing hypothesis
    differs in these data; `expected_separation` by how much it would in the test, what the test's record and these
    would isolate, and what would remain.
    """
    if open_steps := [r for r in findings.accepted if r.ambiguity_group]:
        found = open_steps[0]
    elif findings.verdict == "unexplained" and findings.selection_steps and _are_two(findings.selection_steps[-1]):
        found = replace(findings.selection_steps[-1], ambiguity_group=[_others(findings.selection_steps[-1])[0].ids[0]])
    else:
        return None
    is_throttle = findings.model.device.is_throttle
    if not plans or not is_throttle:
        return _said(found, None, None, findings.model)
    progress("comparing scenarios as the next test")
    best = _best(findings, found, plans)
    left = found.ambiguity_group if best is None else best.left

    def find_plan(model: Model, group: Sequence[str]) -> Plan | None:
        outcome = _isolating_most(plans, model, findings.balances[0], members(found), group)
        return None if outcome is None else outcome.plan

    plan = None if best is None else best.plan
    bench = plan_bench_measurements(findings, found, plan, left, find_plan, progress) if left else None
    return _said(found, best, bench, findings.model)


def _are_two(found: SelectionStep) -> bool:
    """Tell whether two candidates each explain enough to be the cause."""
    others = _others(found)
    return bool(others) and others[0].misfit < _LIKELY


def _others(found: SelectionStep) -> list[Compared]:
    """Return what was compared and has nothing of the winner."""
    return [one for one in found.compared[1:] if not set(one.ids) & set(found.compared[0].ids)]


def _said(found: SelectionStep, best: Outlook | None, bench: BenchPlan | None, model: Model) -> NextTest:
    first, competitors = found.winner.id, found.ambiguity_group
    plan = bench.plan if bench is not None else best.plan if best is not None else None
    evidence = {id_: one.evidence for one in reversed(found.compared) for id_ in one.ids}
    # Whom the test parts least; where none does, or for those whom it does not, a hand has to.
    distances = {} if best is None else best.distances
    left = list(competitors if best is None else best.left) if bench is None else list(bench.left)
    parted = [id_ for id_ in competitors if id_ not in left]
    competitor = min(parted, key=lambda id_: distances.get(id_, np.inf), default=competitors[0])
    is_known = first in evidence and competitor in evidence
    away = float(np.sqrt(2.0 * max(evidence[first] - evidence[competitor], 0.0))) if is_known else None
    expected = None
    if parted:
        expected = Separation(distances.get(competitor), UNIT, tuple(parted), tuple(left))
    return NextTest(
        pair=(first, competitor),
        text=_by_hand(first, (left or [competitor]) if parted else competitors, of_drive=not model.device.is_throttle),
        separation_here=away,
        expected_separation=expected,
        scenario=None if plan is None else plan.name,
        bench_steps=() if bench is None else _instruments(bench, model),
    )


def _instruments(bench: BenchPlan, model: Model) -> tuple[BenchStep, ...]:
    """Return the bench steps, with their entries for a model file's `measured`."""
    numbers = {one.name: one for one in bench.numbers}

    def wanted(name: str, shaft: Shaft | None) -> RequiredParameter:
        width, its = numbers[name].uncertainty, model.parameters.get(name)
        if its is not None:
            width = replace(its, value=width).at_shaft(shaft, model.values.gear_ratio)
        shaft = shaft if its is not None and its.shaft is not None else None
        return RequiredParameter(name, width, numbers[name].unit, shaft)

    return tuple(BenchStep(one.how, tuple(wanted(name, one.shaft) for name in one.gives)) for one in bench.instruments)


def _by_hand(first: str, others: Sequence[str], *, of_drive: bool) -> str:
    effects = [CATALOGUE[id_] for id_ in (first, *others) if id_ in CATALOGUE]
    # A drive has no back-EMF to compare with, and no limp-home.
    own = [effect for effect in effects if of_drive and effect.separated_on_drive]
    ways = [effect.separated_on_drive for effect in own]
    ways += [effect.separated_by for effect in effects if effect not in own]
    return "; or ".join([*dict.fromkeys(ways)][:_WAYS]) or "state a narrower tolerance of the parameter"


def _outlook(plan: Plan, left: Left | None, group: Sequence[str]) -> Outlook:
    if left is None:
        return Outlook(plan, (), tuple(group), 0.0)
    open_ = tuple(id_ for id_ in group if id_ in left.ids)
    return Outlook(plan, tuple(id_ for id_ in group if id_ not in open_), open_, left.shows, left.distances)


def _isolating_most(
    plans: Sequence[Plan], model: Model, like: Balances, truths: Sequence[Truth], group: Sequence[str]
) -> Outlook | None:
    """Return the plan that isolates most of a group; None where none isolates any.

    `truths`: the members of the ambiguity group, the assumed truth first. The record that is expected to isolate most
    is explained. So is the next one, as long as it is expected to isolate more than was found so far.
    """
    truth, *others = truths

    def expected(plan: Plan) -> Outlook:
        record = recorded(plan, model, like, truth.parameters[:EXTENDED])
        return _outlook(plan, expected_beside(truth, others, record, model, group), group)

    best: Outlook | None = None
    for outlook in sorted(side_by_side(expected, plans), key=lambda one: one.worth, reverse=True):
        if best is not None and best.isolates >= outlook.isolates:
            break
        if outlook.shows > 0.0 and all(one < _EXCLUDES for one in outlook.distances.values()):
            continue  # it cannot show the others, or they are the same to it
        record = recorded(outlook.plan, model, like, truth.parameters[:EXTENDED])
        found = _outlook(outlook.plan, left_beside(truth, [record], model, group), group)
        best = found if best is None else max(best, found, key=lambda one: one.worth)
    return best if best is not None and best.parted else None


def _best(findings: Findings, found: SelectionStep, plans: Sequence[Plan]) -> Outlook | None:
    """Return the plan that leaves least open, whichever of the likeliest two is true."""
    truth, *others = members(found)
    model, like, group = findings.model, findings.balances[0], found.ambiguity_group
    best = _isolating_most(plans, model, like, [truth, *others], group)
    if best is None:
        return None
    for other in others[:1]:
        rest = [*truth.ids, *(id_ for id_ in group if id_ not in other.ids)]
        record = recorded(best.plan, model, like, other.parameters[:EXTENDED])
        outcome = _outlook(best.plan, left_beside(other, [record], model, rest), rest)
        # Of two that remain, the one that is not the true cause is the competing hypothesis.
        mixed = other.ids if set(outcome.left) & set(truth.ids) else ()
        open_ = {*outcome.left, *mixed, *best.left}
        parted = tuple(id_ for id_ in group if id_ not in open_)
        best = replace(best, parted=parted, left=tuple(id_ for id_ in group if id_ in open_))
    return best if best.parted else None
