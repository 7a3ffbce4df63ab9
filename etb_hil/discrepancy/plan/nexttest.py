"""The test that would settle what these data leave open: the scenario whose record, beside these, leaves least of it.

Plans are compared by the criterion that made the class; the best are then simulated with a member of it and explained.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from etb_hil.base.side_by_side import side_by_side
from etb_hil.discrepancy.fitting.calibration import calibrate, residual_of
from etb_hil.discrepancy.fitting.floor import group_means, weigh
from etb_hil.discrepancy.plan.beside import TELLING, left_open
from etb_hil.discrepancy.plan.handtest import HandTest, hand_test, unseen
from etb_hil.discrepancy.plan.planned import Plan, recorded
from etb_hil.discrepancy.search.decision import class_margin
from etb_hil.discrepancy.search.findings import Findings, Round
from etb_hil.discrepancy.search.naming import search
from etb_hil.discrepancy.search.rivals import alike
from etb_hil.discrepancy.suspects.candidates import suspects
from etb_hil.discrepancy.suspects.refining import LEAST_GAIN, Refined
from etb_hil.discrepancy.suspects.similarity import Projector
from etb_hil.plant.drive_file import is_drive
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector
from etb_hil.plant.table_one import Shaft
from etb_hil.results.explanation import BenchStep, NextTest, Separation, Wanted

UNIT = "standard deviations of the sensors' noise"
_TRIED = 2  # plans that are explained before one is asked for
_WAYS = 3  # at the bench, that are said
_LIKELY = 0.5  # of the residual, that a candidate leaves at most for a test of it to be worth a run


@dataclass(frozen=True, slots=True)
class Outlook:
    """What a plan's record would tell: `parted` of the cause's class it tells from the cause, `left` stays open.

    `left` may hold ids that these data could not judge; `shows`: the cause beside the base parameters, over the noise;
    `distances` by id, likewise, of competing hypotheses that were fitted.
    """

    plan: Plan
    parted: tuple[str, ...]
    left: tuple[str, ...]
    shows: float
    distances: dict[str, float] = field(default_factory=dict)

    @property
    def worth(self) -> tuple[int, int, float]:
        """What plans are ranked by: how little stays open, how much is distinguished, how well the cause shows."""
        return -len(self.left), len(self.parted), self.shows


def next_test(
    findings: Findings, plans: Sequence[Plan] = (), progress: Callable[[str], None] = lambda _: None
) -> NextTest | None:
    """Return the test for what is open; None where nothing is, or no candidate comes near to what is missing.

    Of the `plans` it takes the one that leaves least open.

    `separation_here` is by how much a competing hypothesis differs in these data; `expected_separation` by how much
    it would in the test, what the test's record and these would part from the cause, and what would stay open.
    """
    if open_rounds := [r for r in findings.accepted if r.alike]:
        found = open_rounds[0]
    elif findings.verdict == "unexplained" and findings.rounds and _are_two(findings.rounds[-1]):
        found = replace(findings.rounds[-1], alike=[findings.rounds[-1].refined[1].id])
    else:
        return None
    best: Outlook | None = None
    if plans and not any(b.measured.is_drive for b in findings.balances):
        compared = side_by_side(lambda plan: _compared(plan, findings, found), plans)
        for outlook in sorted(compared, key=lambda one: one.worth, reverse=True)[:_TRIED]:
            if best is not None and best.worth >= outlook.worth:
                break  # what was explained leaves no more open than what was only compared
            progress(f"trying {outlook.plan.name} as the next test")
            told = _promised(outlook, findings, found)
            best = told if best is None or told.worth > best.worth else best
        best = best if best is not None and best.parted else None
    hand = None
    left = found.alike if best is None else best.left
    if plans and left and not any(b.measured.is_drive for b in findings.balances):

        def find_plan(known: Findings, judged: Round) -> Plan | None:
            told = max(side_by_side(lambda plan: _compared(plan, known, judged), plans), key=lambda one: one.worth)
            return told.plan if told.parted else None

        hand = hand_test(findings, found, None if best is None else best.plan, left, find_plan, progress)
    return _said(found, best, hand, findings.model)


def _are_two(found: Round) -> bool:
    """Tell whether two candidates each take so much of the residual that one of them may be what is missing."""
    return len(found.refined) > 1 and found.refined[1].fit.cost < _LIKELY * found.before.fit.cost


def _said(found: Round, best: Outlook | None, hand: HandTest | None, model: Model) -> NextTest:
    first, rivals = found.winner.id, found.alike
    plan = hand.plan if hand is not None else best.plan if best is not None else None
    costs = {one.id: one.fit.cost for one in found.refined}
    # Whom the test parts least; where none does, or for those whom it does not, a hand has to.
    distances = {} if best is None else best.distances
    left = list(rivals if best is None else best.left) if hand is None else list(hand.left)
    parted = [id_ for id_ in rivals if id_ not in left]
    rival = min(parted, key=lambda id_: distances.get(id_, np.inf), default=rivals[0])
    away = float(np.sqrt(max(costs[rival] - costs[first], 0.0))) if rival in costs else None
    expected = None
    if parted:
        expected = Separation(distances.get(rival), UNIT, tuple(parted), tuple(left))
    return NextTest(
        pair=(first, rival),
        says=_by_hand(first, (left or [rival]) if parted else rivals, of_drive=is_drive(model)),
        separation_here=away,
        expected_separation=expected,
        scenario=None if plan is None else plan.name,
        by_hand=() if hand is None else _instruments(hand, model),
    )


def _instruments(hand: HandTest, model: Model) -> tuple[BenchStep, ...]:
    """Return what to do by hand, and the entries that it gives for a model file's `measured`, at the shaft it is at."""
    numbers = {one.name: one for one in hand.numbers}

    def wanted(name: str, shaft: Shaft | None) -> Wanted:
        width, its = numbers[name].uncertainty, model.parameters.get(name)
        if its is not None:
            width = replace(its, value=width).at_shaft(shaft, model.values.gear_ratio)
        shaft = shaft if its is not None and its.shaft is not None else None
        return Wanted(name, width, numbers[name].unit, shaft)

    return tuple(BenchStep(one.how, tuple(wanted(name, one.shaft) for name in one.gives)) for one in hand.instruments)


def _by_hand(first: str, others: Sequence[str], *, of_drive: bool) -> str:
    effects = [CATALOGUE[id_] for id_ in (first, *others) if id_ in CATALOGUE]
    # A drive has no back-EMF to compare with, and no limp-home.
    own = [effect for effect in effects if of_drive and effect.separated_on_drive]
    ways = [effect.separated_on_drive for effect in own]
    ways += [effect.separated_by for effect in effects if effect not in own]
    return "; or ".join([*dict.fromkeys(ways)][:_WAYS]) or "state the parameter's tolerance more narrowly"


def _compared(plan: Plan, findings: Findings, found: Round) -> Outlook:
    """Return what the criterion that made the class says of a plan's record without the cause."""
    healthy_whole, whole = _without(found), found.winner.fit.whole.copy()
    whole[EXTENDED:] = 0.0
    record = [recorded(plan, findings.model, findings.balances[0], healthy_whole[:EXTENDED])]
    weigh(record, group_means(record, healthy_whole)[0])  # nothing is missing in it: what it leaves is its noise floor
    healthy = calibrate(findings.model, record, healthy_whole, found.before.unknowns, rounds=1)
    residual = residual_of(record)
    does = residual(whole) - residual(healthy_whole)
    if float(does @ does) < LEAST_GAIN * healthy.fit.cost:
        return Outlook(plan, (), tuple(found.alike), 0.0)
    suspected = frozenset({found.winner.candidate.frees} - {""})
    shows = Projector(healthy.columns, healthy.unknowns).rest(does, suspected)
    shapes = suspects(record, found.before.unknowns)
    members = [one for one in found.screened if one.candidate.id in {*found.alike} & {*shapes}]
    names = alike(replace(found, screened=members, refined=[found.winner]), record, healthy, shapes, is_all=True)
    return _outlook(plan, found, [*names, *unseen(found, shapes)], float(np.linalg.norm(shows)))


def _outlook(plan: Plan, found: Round, left: Iterable[str], shows: float) -> Outlook:
    """Return what a plan tells whose record alone would leave `left` open beside the cause."""
    left = tuple(dict.fromkeys(left_open(left, found)))
    return Outlook(plan, tuple(id_ for id_ in found.alike if id_ not in left), left, shows)


def _without(found: Round) -> Vector:
    """Return a round's fit with its winner taken out again: as it was before it, or its parameter back in its box."""
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


def _promised(compared: Outlook, findings: Findings, found: Round) -> Outlook:
    """Return what of a comparison holds once the plan's record is explained, with the cause or its best competitor."""
    first = found.winner
    told = _explained(compared, findings, found, first)
    left = [*compared.left, *told.left]
    other = next((r for r in found.refined if r.id in found.alike), None)
    if told.parted and other is not None and np.log(other.fit.cost / first.fit.cost) < class_margin(found):
        left += _explained(compared, findings, found, other).left
    return replace(_outlook(compared.plan, found, left, compared.shows), distances=told.distances)


def _explained(compared: Outlook, findings: Findings, found: Round, truth: Refined) -> Outlook:
    """Return what naming says of a plan's record beside these, with a member of the class as it was fitted here."""
    record = recorded(compared.plan, findings.model, findings.balances[0], truth.fit.whole[:EXTENDED])
    told = search(findings.model, [record])
    if told.is_cut_short:
        raise KeyboardInterrupt  # a search ends with what it knows; what is known of a plan in part is nothing
    for named in told.accepted if told.verdict in TELLING else ():
        ids = [named.winner.id, *named.alike]
        if truth.id in ids:
            costs = {one.candidate.id: one.cost for one in named.screened} | {r.id: r.fit.cost for r in named.refined}
            own = costs.get(truth.id, np.nan)
            away = {id_: float(np.sqrt(abs(cost - own))) for id_, cost in costs.items() if np.isfinite(own)}
            # Of two that stay beside each other it is the competing hypothesis that the cause is not told from.
            left = [truth.id if id_ == found.winner.id else id_ for id_ in ids if id_ != truth.id]
            left += unseen(found, suspects([record], found.before.unknowns))
            return replace(_outlook(compared.plan, found, left, compared.shows), distances=away)
    return Outlook(compared.plan, (), tuple(found.alike), compared.shows)
