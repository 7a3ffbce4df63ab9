"""The next test: the scenario whose record would leave least ambiguous.

Plans are compared by the criterion of the ambiguity group; the best are then simulated with a member of it and
explained.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from etb_hil.base.side_by_side import side_by_side
from etb_hil.discrepancy.candidates.candidate import candidates_for
from etb_hil.discrepancy.candidates.collinearity import Projector
from etb_hil.discrepancy.candidates.refinement import LEAST_GAIN, Refined
from etb_hil.discrepancy.fitting.calibration import calibrate, residual_of
from etb_hil.discrepancy.fitting.noise_floor import group_means, weigh
from etb_hil.discrepancy.plan.bench_measurements import BenchPlan, plan_bench_measurements, unseen
from etb_hil.discrepancy.plan.narrowing import INFORMATIVE, left_open
from etb_hil.discrepancy.plan.planned import Plan, recorded
from etb_hil.discrepancy.search.ambiguity import ambiguity_group
from etb_hil.discrepancy.search.decision import ambiguity_margin
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.drive_file import is_drive
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector
from etb_hil.plant.table_one import Shaft
from etb_hil.results.explained.next_test import BenchStep, NextTest, RequiredParameter, Separation

UNIT = "standard deviations of the sensors' noise"
_TRIED = 2  # plans that are explained before one is asked for
_WAYS = 3  # at the bench, that are said
_LIKELY = 0.5  # of the residual, that a candidate leaves at most for a test of it to be worth a run


@dataclass(frozen=True, slots=True)
class Outlook:
    """Prospects of a plan: `parted` of the ambiguity group it isolates, `left` remain.

    `left` may hold ids that these data could not judge; `shows`: the cause given the base parameters, over the noise;
    `distances` by id, likewise, of competing hypotheses that were fitted.
    """

    plan: Plan
    parted: tuple[str, ...]
    left: tuple[str, ...]
    shows: float
    distances: dict[str, float] = field(default_factory=dict)

    @property
    def worth(self) -> tuple[int, int, float]:
        """The rank of a plan: how little remains, how much is isolated, how well it shows."""
        return -len(self.left), len(self.parted), self.shows


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
        found = replace(findings.selection_steps[-1], ambiguity_group=[findings.selection_steps[-1].refined[1].id])
    else:
        return None
    best: Outlook | None = None
    if plans and not any(b.measured.is_drive for b in findings.balances):
        compared = side_by_side(lambda plan: _compared(plan, findings, found), plans)
        for outlook in sorted(compared, key=lambda one: one.worth, reverse=True)[:_TRIED]:
            if best is not None and best.worth >= outlook.worth:
                break  # what was explained leaves no more open than what was only compared
            progress(f"trying {outlook.plan.name} as the next test")
            outcome = _promised(outlook, findings, found)
            best = outcome if best is None or outcome.worth > best.worth else best
        best = best if best is not None and best.parted else None
    bench = None
    left = found.ambiguity_group if best is None else best.left
    if plans and left and not any(b.measured.is_drive for b in findings.balances):

        def find_plan(known: Findings, judged: SelectionStep) -> Plan | None:
            outcome = max(side_by_side(lambda plan: _compared(plan, known, judged), plans), key=lambda one: one.worth)
            return outcome.plan if outcome.parted else None

        bench = plan_bench_measurements(findings, found, None if best is None else best.plan, left, find_plan, progress)
    return _said(found, best, bench, findings.model)


def _are_two(found: SelectionStep) -> bool:
    """Tell whether two candidates each explain enough to be the cause."""
    return len(found.refined) > 1 and found.refined[1].fit.cost < _LIKELY * found.before.fit.cost


def _said(found: SelectionStep, best: Outlook | None, bench: BenchPlan | None, model: Model) -> NextTest:
    first, competitors = found.winner.id, found.ambiguity_group
    plan = bench.plan if bench is not None else best.plan if best is not None else None
    costs = {one.id: one.fit.cost for one in found.refined}
    # Whom the test parts least; where none does, or for those whom it does not, a hand has to.
    distances = {} if best is None else best.distances
    left = list(competitors if best is None else best.left) if bench is None else list(bench.left)
    parted = [id_ for id_ in competitors if id_ not in left]
    competitor = min(parted, key=lambda id_: distances.get(id_, np.inf), default=competitors[0])
    away = float(np.sqrt(max(costs[competitor] - costs[first], 0.0))) if competitor in costs else None
    expected = None
    if parted:
        expected = Separation(distances.get(competitor), UNIT, tuple(parted), tuple(left))
    return NextTest(
        pair=(first, competitor),
        text=_by_hand(first, (left or [competitor]) if parted else competitors, of_drive=is_drive(model)),
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


def _compared(plan: Plan, findings: Findings, found: SelectionStep) -> Outlook:
    """Return a plan's prospects by the criterion of the ambiguity group."""
    healthy_whole, whole = _without(found), found.winner.fit.whole.copy()
    whole[EXTENDED:] = 0.0
    record = [recorded(plan, findings.model, findings.balances[0], healthy_whole[:EXTENDED])]
    weigh(record, group_means(record, healthy_whole)[0])  # nothing is missing in it: what it leaves is its noise floor
    healthy = calibrate(findings.model, record, healthy_whole, found.before.unknowns, iterations=1)
    residual = residual_of(record)
    does = residual(whole) - residual(healthy_whole)
    if float(does @ does) < LEAST_GAIN * healthy.fit.cost:
        return Outlook(plan, (), tuple(found.ambiguity_group), 0.0)
    not_projected = frozenset({found.winner.candidate.frees} - {""})
    shows = Projector(healthy.jacobian, healthy.unknowns).rest(does, not_projected)
    shapes = candidates_for(record, found.before.unknowns)
    members = [one for one in found.screened if one.candidate.id in {*found.ambiguity_group} & {*shapes}]
    names = ambiguity_group(
        replace(found, screened=members, refined=[found.winner]), record, healthy, shapes, is_all=True
    )
    return _outlook(plan, found, [*names, *unseen(found, shapes)], float(np.linalg.norm(shows)))


def _outlook(plan: Plan, found: SelectionStep, left: Iterable[str], shows: float) -> Outlook:
    """Return the prospects of a plan whose record alone would leave `left`."""
    left = tuple(dict.fromkeys(left_open(left, found)))
    return Outlook(plan, tuple(id_ for id_ in found.ambiguity_group if id_ not in left), left, shows)


def _without(found: SelectionStep) -> Vector:
    """Return a step's fit without its winner, its parameter in tolerance."""
    winner = found.winner
    whole = winner.fit.whole.copy()
    whole[EXTENDED:] = 0.0
    if winner.candidate.effect is not None:
        places = list(winner.candidate.effect.stated_indices)
        whole[places] = found.before.fit.whole[places]
    for unknown in found.before.unknowns:
        if unknown.name == winner.candidate.frees:
            unknown.put(whole, float(np.clip(unknown.x_of(whole), unknown.low, unknown.high)))
    return whole


def _promised(compared: Outlook, findings: Findings, found: SelectionStep) -> Outlook:
    """Return a plan's prospects confirmed by explaining its simulated record.

    The truth is the cause, then its best competitor.
    """
    first = found.winner
    outcome = _explained(compared, findings, found, first)
    left = [*compared.left, *outcome.left]
    other = next((r for r in found.refined if r.id in found.ambiguity_group), None)
    if outcome.parted and other is not None and np.log(other.fit.cost / first.fit.cost) < ambiguity_margin(found):
        left += _explained(compared, findings, found, other).left
    return replace(_outlook(compared.plan, found, left, compared.shows), distances=outcome.distances)


def _explained(compared: Outlook, findings: Findings, found: SelectionStep, truth: Refined) -> Outlook:
    """Return a plan's prospects if a member of the ambiguity group is true."""
    record = recorded(compared.plan, findings.model, findings.balances[0], truth.fit.whole[:EXTENDED])
    outcome = search(findings.model, [record])
    if outcome.is_interrupted:
        raise KeyboardInterrupt  # a search ends with what it knows; what is known of a plan in part is nothing
    for named in outcome.accepted if outcome.verdict in INFORMATIVE else ():
        ids = [named.winner.id, *named.ambiguity_group]
        if truth.id in ids:
            costs = {one.candidate.id: one.cost for one in named.screened} | {r.id: r.fit.cost for r in named.refined}
            own = costs.get(truth.id, np.nan)
            away = {id_: float(np.sqrt(abs(cost - own))) for id_, cost in costs.items() if np.isfinite(own)}
            # Of two that remain, the one that is not the true cause is the competing hypothesis.
            left = [truth.id if id_ == found.winner.id else id_ for id_ in ids if id_ != truth.id]
            left += unseen(found, candidates_for([record], found.before.unknowns))
            return replace(_outlook(compared.plan, found, left, compared.shows), distances=away)
    return Outlook(compared.plan, (), tuple(found.ambiguity_group), compared.shows)
