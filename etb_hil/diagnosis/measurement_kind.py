"""Declaration of a measurement.

One file of `measurements/` holds one declaration and how the value is computed.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from etb_hil.base.quantity import is_si, si_unit_meant
from etb_hil.base.roles import ROLES

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings
    from etb_hil.diagnosis.result import Reason


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value in SI with its 95 % interval, None where unknown.

    An interval from 0 without a value is a bound: the value is at most `high`, and no more is known.
    `note` says under which conditions it holds. Where a measurement gives several values, `suffix` sets their ids apart
    (`T_st_at_rate_1`) and `name` their names; empty: the words of the suffix do. `may_pass` is False where the run saw
    too little of the unit for a pass. `undecided` takes the place of the usual reason where the interval reaches over a
    limit; `if_failed` is added to the reason of a fail. `is_least`: the value is the least that it may be, so that no
    unit passes by it, and none fails a lower limit.
    """

    value: float | None
    low: float | None = None
    high: float | None = None
    note: str = ""
    suffix: str = ""
    name: str = ""
    may_pass: bool = True
    undecided: Reason | None = None
    if_failed: str = ""
    is_least: bool = False


@dataclass(frozen=True, slots=True)
class FailedEstimate(Estimate):
    """An estimate without a value, since the code of its plug-in failed."""


Found = Estimate | Iterable[Estimate] | None


@dataclass(frozen=True, slots=True)
class MeasurementKind:
    """The declaration of a measurement.

    `id` names it in files; `name` is what every page, table and message calls it, `unit` its SI unit. `compute` returns
    the value from what is known of a run, None where the run does not tell. `order` sorts measurements for people,
    judged ones first. `source` is the definition: an equation, a standard, a data sheet. `too_high` and `too_low` say
    what to do with a unit beyond the upper or lower limit; empty: replace it.

    `suffixes` is the pattern of what sets several values apart, as in `Estimate.suffix` without its underscore.
    `phases` are the kinds of phase that it is taken from, one of them at least; empty: the motion of the whole run.
    `roles` are the signals that it needs beside current and motor angle. `is_friction`: a friction torque, which
    follows temperature and may differ by direction. `friction_of` is the friction torque that the value is reduced by.
    `is_model_free`: the value holds without the bench's model, and keeps its interval where data contradict that.
    `judged_at_rest_by` is the measurement whose limit applies where that limit states a law of rest. `least_limit` is
    the smallest limit that makes sense, in SI. Without intervals (`has_interval`) a value is for people: nothing tells
    it from a limit, and none may be stated.
    """

    id: str
    name: str
    unit: str
    compute: Callable[[Findings], Found]
    order: int
    source: str = ""
    too_high: str = ""
    too_low: str = ""
    suffixes: str = ""
    phases: frozenset[str] = frozenset()
    roles: frozenset[str] = frozenset()
    is_friction: bool = False
    friction_of: str = ""
    is_model_free: bool = False
    judged_at_rest_by: str = ""
    least_limit: float | None = None
    has_interval: bool = True

    def name_of(self, suffix: str, name: str = "") -> str:
        """Return the name of a value, by `suffix` and `name` of its estimate."""
        words = name or suffix.strip("_").replace("_", " ")
        return f"{self.name} ({words})" if words else self.name


def misstatements(kind: MeasurementKind, others: Collection[str]) -> Iterator[str]:
    """Yield what is wrong with the declaration of a measurement, in sentences.

    `others` are the ids of the other measurements.
    """
    if not kind.id.isidentifier():
        yield f"the id of a measurement is a name of letters, digits and underscores (it is {kind.id!r})"
    if kind.id in others:
        yield f"there is a measurement with the id {kind.id} already"
    if not _takes_one(kind.compute):
        yield "`compute` must be a function of one argument, the findings of a run"
    if not is_si(kind.unit):
        meant = si_unit_meant(kind.unit)
        remedy = f"did you mean '{meant}'?" if meant else "write it with A, V, rad, N·m and the like, '1' for a ratio"
        yield f"the unit must be an SI unit (got {kind.unit!r}); {remedy}"
    if unknown := sorted(set(kind.roles) - ROLES.keys()):
        yield f"there is no role {', '.join(unknown)}"
    try:
        re.compile(kind.suffixes)
    except re.error as error:
        yield f"`suffixes` must be a regular expression: {error}"
    for other in filter(None, (kind.friction_of, kind.judged_at_rest_by)):
        if other not in others:
            yield f"there is no measurement {other}"


def _takes_one(function: object) -> bool:
    if not callable(function):
        return False
    try:
        inspect.signature(function).bind(None)
    except TypeError:
        return False
    return True
