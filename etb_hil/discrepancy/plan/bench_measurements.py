"""Planned bench measurements: what known parameters would isolate.

The record at hand, and a plan's, are explained with them known.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.discrepancy.candidates.candidate import candidates_for
from etb_hil.discrepancy.candidates.refinement import Refined
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.plan.instruments import Instrument, as_measured, instruments
from etb_hil.discrepancy.plan.narrowing import INFORMATIVE, left_open
from etb_hil.discrepancy.plan.planned import Plan, recorded
from etb_hil.discrepancy.search.decision import ambiguity_margin
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.measured import Measured
from etb_hil.plant.parameters import Model

_MOST = 5  # instruments that a technician is asked to take out


FindPlan = Callable[[Findings, SelectionStep], Plan | None]


@dataclass(frozen=True, slots=True)
class BenchPlan:
    """Instruments, their readings if the cause is true, and what stays `left`.

    `plan`: the scenario to run besides, None where the record at hand is explained again.
    """

    instruments: list[Instrument]
    numbers: list[Measured]
    left: tuple[str, ...]
    plan: Plan | None


@dataclass(frozen=True, slots=True)
class _Outcome:
    """The search's outcome if a member of the ambiguity group is true; `ids` remain."""

    ids: list[str]
    findings: Findings
    judged: SelectionStep


def plan_bench_measurements(
    findings: Findings,
    found: SelectionStep,
    plan: Plan | None,
    left: Sequence[str],
    find_plan: FindPlan,
    progress: Callable[[str], None] = lambda _: None,
) -> BenchPlan | None:
    """Return what to measure at the bench about the hypotheses that a plan leaves.

    Without a plan it is about the record. None where no measurement helps. What judges the cause itself comes first.
    Hypotheses that become competitive once parameters are known are measured, too, up to `_MOST` instruments, or left
    to a plan that separates them then.
    """
    best: BenchPlan | None = None
    known, used = instruments(), list[Instrument]()
    open_ = list(left)
    while open_ and len(used) < _MOST:
        ids = [found.winner.id, *open_]
        wanted = dict.fromkeys(one for id_ in ids for one in known if id_ in one.ids and one not in used)
        if not wanted:
            break
        used += [*wanted][: _MOST - len(used)]
        progress("trying bench measurements")
        open_, here = _left(findings, found, found.winner, used, plan)
        if open_ and plan is None and here is not None:
            tried = find_plan(here.findings, here.judged)
            then = open_ if tried is None else _left(findings, found, found.winner, used, tried)[0]
            if len(then) < len(open_):
                open_, plan = then, tried
        if best is None or len(open_) < len(best.left):
            best = BenchPlan(list(used), _numbers(findings, found.winner, used), tuple(open_), plan)
    other = next((r for r in found.refined if r.id in found.ambiguity_group), None)
    if (
        best is not None
        and other is not None
        and np.log(other.fit.cost / found.winner.fit.cost) < ambiguity_margin(found)
    ):
        more, _ = _left(findings, found, other, best.instruments, best.plan)
        best = replace(best, left=tuple(dict.fromkeys([*best.left, *more])))
    return best if best is not None and len(best.left) < len(left) else None


def _numbers(findings: Findings, truth: Refined, used: Sequence[Instrument]) -> list[Measured]:
    return as_measured(findings.model, truth.fit.whole[:EXTENDED], used)


def _left(
    findings: Findings, found: SelectionStep, truth: Refined, used: Sequence[Instrument], plan: Plan | None
) -> tuple[list[str], _Outcome | None]:
    """Return what stays ambiguous with a true member once its parameters are measured.

    The second value is the outcome for the record at hand, where that was needed and is informative.
    """
    model = findings.model.knowing(_numbers(findings, truth, used))
    is_seen = any(one.is_off and one.id == truth.id for one in model.measured.values())
    there: list[str] | None = None
    if plan is not None:
        record = recorded(plan, model, findings.balances[0], truth.fit.whole[:EXTENDED])
        outcome = _outcome_of(model, [record], truth)
        if outcome is not None:
            blind_to = () if is_seen else unseen(found, candidates_for([record], outcome.judged.before.unknowns))
            there = [*outcome.ids, *blind_to]
            if not there:
                return [], None
    here = _outcome_of(model, [Balances(b.measured, model) for b in findings.balances], truth)
    if here is None:
        return list(found.ambiguity_group), None
    return (here.ids if there is None else left_open(there, here.judged)), here


def _outcome_of(model: Model, balances: Sequence[Balances], truth: Refined) -> _Outcome | None:
    """Return what stays ambiguous with the truth in a record; None if it is not found."""
    outcome = search(model, balances)
    if outcome.is_interrupted:
        raise KeyboardInterrupt  # a search ends with what it knows; what is known of a plan in part is nothing
    for named in outcome.accepted if outcome.verdict in INFORMATIVE else ():
        ids = [named.winner.id, *named.ambiguity_group]
        if truth.id in ids:
            return _Outcome([id_ for id_ in ids if id_ != truth.id], outcome, named)
    return None


def unseen(found: SelectionStep, seen: Mapping[str, object]) -> list[str]:
    """Return an ambiguity group's effects that a record cannot test."""
    return [id_ for id_ in found.ambiguity_group if id_ in CATALOGUE and id_ not in seen]
