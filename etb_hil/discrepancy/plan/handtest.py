"""What numbers measured at the bench would settle: the record at hand, and a plan's, explained with them known."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.plan.beside import TELLING, left_open
from etb_hil.discrepancy.plan.hands import Instrument, as_measured, instruments
from etb_hil.discrepancy.plan.planned import Plan, recorded
from etb_hil.discrepancy.search.decision import class_margin
from etb_hil.discrepancy.search.findings import Findings, Round
from etb_hil.discrepancy.search.naming import search
from etb_hil.discrepancy.suspects.candidates import suspects
from etb_hil.discrepancy.suspects.refining import Refined
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.measured import Measured
from etb_hil.plant.parameters import Model

_MOST = 5  # instruments that a technician is asked to take out


FindPlan = Callable[[Findings, Round], Plan | None]


@dataclass(frozen=True, slots=True)
class HandTest:
    """Instruments to take out, the numbers that they would read (the cause being the truth), and what stays `left`.

    `plan`: the scenario to run beside it, None where the record at hand is explained again.
    """

    instruments: list[Instrument]
    numbers: list[Measured]
    left: tuple[str, ...]
    plan: Plan | None


@dataclass(frozen=True, slots=True)
class _Told:
    """What naming says of a record in which a member of the class is the truth; `ids` stay beside it."""

    ids: list[str]
    findings: Findings
    judged: Round


def hand_test(
    findings: Findings,
    found: Round,
    plan: Plan | None,
    left: Sequence[str],
    find_plan: FindPlan,
    progress: Callable[[str], None] = lambda _: None,
) -> HandTest | None:
    """Return what a hand should measure about those that a plan leaves (without a plan the record); None: nothing.

    First what judges the cause itself. What becomes a competing hypothesis only where numbers are known is measured,
    too, as far as
    `_MOST` instruments go, or left to a plan that parts it now.
    """
    best: HandTest | None = None
    known, used = instruments(), list[Instrument]()
    open_ = list(left)
    while open_ and len(used) < _MOST:
        ids = [found.winner.id, *open_]
        wanted = dict.fromkeys(one for id_ in ids for one in known if id_ in one.ids and one not in used)
        if not wanted:
            break
        used += [*wanted][: _MOST - len(used)]
        progress("trying what a hand could measure")
        open_, here = _left(findings, found, found.winner, used, plan)
        if open_ and plan is None and here is not None:
            tried = find_plan(here.findings, here.judged)
            then = open_ if tried is None else _left(findings, found, found.winner, used, tried)[0]
            if len(then) < len(open_):
                open_, plan = then, tried
        if best is None or len(open_) < len(best.left):
            best = HandTest(list(used), _numbers(findings, found.winner, used), tuple(open_), plan)
    other = next((r for r in found.refined if r.id in found.alike), None)
    if best is not None and other is not None and np.log(other.fit.cost / found.winner.fit.cost) < class_margin(found):
        more, _ = _left(findings, found, other, best.instruments, best.plan)
        best = replace(best, left=tuple(dict.fromkeys([*best.left, *more])))
    return best if best is not None and len(best.left) < len(left) else None


def _numbers(findings: Findings, truth: Refined, used: Sequence[Instrument]) -> list[Measured]:
    return as_measured(findings.model, truth.fit.whole[:EXTENDED], used)


def _left(
    findings: Findings, found: Round, truth: Refined, used: Sequence[Instrument], plan: Plan | None
) -> tuple[list[str], _Told | None]:
    """Return what stays beside a member of a class that is the truth, once numbers of it were measured.

    And what is said of the record at hand, where that was asked for and tells something.
    """
    model = findings.model.knowing(_numbers(findings, truth, used))
    is_seen = any(one.is_off and one.id == truth.id for one in model.measured.values())
    there: list[str] | None = None
    if plan is not None:
        record = recorded(plan, model, findings.balances[0], truth.fit.whole[:EXTENDED])
        told = _told_of(model, [record], truth)
        if told is not None:
            blind_to = () if is_seen else unseen(found, suspects([record], told.judged.before.unknowns))
            there = [*told.ids, *blind_to]
            if not there:
                return [], None
    here = _told_of(model, [Balances(b.measured, model) for b in findings.balances], truth)
    if here is None:
        return list(found.alike), None
    return (here.ids if there is None else left_open(there, here.judged)), here


def _told_of(model: Model, balances: Sequence[Balances], truth: Refined) -> _Told | None:
    """Return what stays beside the truth in a record; None where no class holds it."""
    told = search(model, balances)
    if told.is_cut_short:
        raise KeyboardInterrupt  # a search ends with what it knows; what is known of a plan in part is nothing
    for named in told.accepted if told.verdict in TELLING else ():
        ids = [named.winner.id, *named.alike]
        if truth.id in ids:
            return _Told([id_ for id_ in ids if id_ != truth.id], told, named)
    return None


def unseen(found: Round, seen: Mapping[str, object]) -> list[str]:
    """Return the effects of a class that are no candidates in a record: it excludes none of them."""
    return [id_ for id_ in found.alike if id_ in CATALOGUE and id_ not in seen]
