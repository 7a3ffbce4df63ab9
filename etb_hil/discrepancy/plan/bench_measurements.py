"""Planned bench measurements: what known parameters would isolate.

The record at hand, and a plan's, are explained with them known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

from etb_hil.discrepancy.plan.planned import Plan, recorded
from etb_hil.discrepancy.plan.prospects import Truth, left_beside, members
from etb_hil.discrepancy.search.extended_model import calibrated_parameters
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.effect import BenchMeasurement
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.measured import Measured, measured_parameter
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector
from etb_hil.plant.table_one import KINDS, Shaft

_MOST = 5  # instruments that a technician is asked to take out


FindPlan = Callable[[Model, Sequence[str]], Plan | None]


@dataclass(frozen=True, slots=True)
class BenchPlan:
    """Instruments, their readings if the cause is true, and what stays `left`.

    `plan`: the scenario to run besides, None where the record at hand is explained again.
    """

    instruments: list[Instrument]
    numbers: list[Measured]
    left: tuple[str, ...]
    plan: Plan | None


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
    truth, *others = members(found)
    known, used = instruments(), list[Instrument]()
    open_ = list(left)
    while open_ and len(used) < _MOST:
        ids = [found.winner.id, *open_]
        wanted = dict.fromkeys(one for id_ in ids for one in known if id_ in one.ids and one not in used)
        if not wanted:
            break
        used += [*wanted][: _MOST - len(used)]
        progress("trying bench measurements")
        open_ = _left(findings, found, truth, used, plan)
        if open_ and plan is None:
            tried = find_plan(_knowing(findings, truth, used), open_)
            then = open_ if tried is None else _left(findings, found, truth, used, tried)
            if len(then) < len(open_):
                open_, plan = then, tried
        if best is None or len(open_) < len(best.left):
            best = BenchPlan(list(used), _numbers(findings, truth, used), tuple(open_), plan)
    if best is None:
        return None
    for other in others[:1]:
        more = _left(findings, found, other, best.instruments, best.plan)
        best = replace(best, left=tuple(dict.fromkeys([*best.left, *more])))
    return best if len(best.left) < len(left) else None


def _numbers(findings: Findings, truth: Truth, used: Sequence[Instrument]) -> list[Measured]:
    return as_measured(findings.model, truth.parameters[:EXTENDED], used)


def _knowing(findings: Findings, truth: Truth, used: Sequence[Instrument]) -> Model:
    return findings.model.knowing(_numbers(findings, truth, used))


def _left(
    findings: Findings, found: SelectionStep, truth: Truth, used: Sequence[Instrument], plan: Plan | None
) -> list[str]:
    """Return what stays ambiguous with a true member once its parameters are measured.

    With a plan, that is what neither its record nor the one at hand excludes.
    """
    model, group = _knowing(findings, truth, used), found.ambiguity_group
    here = left_beside(truth, [b.measured for b in findings.balances], model)
    if plan is None:
        return list(group if here is None else here.ids)
    like = findings.balances[0]
    asked = [id_ for id_ in (group if here is None else here.ids) if id_ not in truth.ids]
    there = left_beside(truth, [recorded(plan, model, like, truth.parameters[:EXTENDED])], model, asked)
    return asked if there is None else [id_ for id_ in asked if id_ in there.ids]


@dataclass(frozen=True, slots=True, eq=False)
class Instrument:
    """One bench measurement, and its parameters with uncertainties, at a `shaft`."""

    how: str
    gives: dict[str, float]
    shaft: Shaft | None = None

    @property
    def ids(self) -> set[str]:
        """The ids of causes that its parameters judge."""
        return {name.partition(".")[0] if "." in name else f"parameter:{name}" for name in self.gives}


# Base parameters by what gives them without a run: name and uncertainty, and the shaft that rotary ones are stated for.
# Uncertainties are what these instruments reach with care, as shares; of angles and effects' strengths in their units.
_BASE: dict[str, tuple[dict[str, float], Shaft | None]] = {
    BenchMeasurement.RESISTANCE: ({"resistance": 0.01}, None),
    BenchMeasurement.MOTOR_CONSTANT: ({"torque_constant": 0.01}, Shaft.MOTOR),
    BenchMeasurement.SPRINGS: (
        {"preload_open": 0.02, "preload_close": 0.02, "slope_open": 0.03, "slope_close": 0.03},
        Shaft.THROTTLE,
    ),
    BenchMeasurement.STOPS: ({"stop_low": 0.001, "stop_high": 0.001, "limp_home": 0.001}, Shaft.THROTTLE),
    BenchMeasurement.FRICTION: ({"coulomb": 0.03, "stiction": 0.03}, Shaft.THROTTLE),
}


def instruments() -> list[Instrument]:
    """Return all bench measurements: of base parameters, and of effects' strengths."""
    found = []
    for how in dict.fromkeys([*BenchMeasurement, *(effect.by_bench[0] for effect in CATALOGUE.values())]):
        gives, shaft = _BASE.get(how, ({}, None))
        for effect in CATALOGUE.values():
            if effect.by_bench[0] == how:
                gives = gives | {f"{effect.id}.{name}": width for name, width in effect.by_bench[1].items()}
        if how and gives:
            found.append(Instrument(str(how), gives, shaft))
    return found


def as_measured(model: Model, p: Vector, instruments: Iterable[Instrument]) -> list[Measured]:
    """Return what instruments would read of a unit with extended parameters `p`."""
    found = []
    parameters = calibrated_parameters(model, p)
    for name, uncertainty in ((name, width) for one in instruments for name, width in one.gives.items()):
        if "." not in name:
            value = parameters[name].value
            width = uncertainty if KINDS[name].dimension == "angle" else uncertainty * abs(value)
            found.append(measured_parameter(model.parameters[name], value, width))
            continue
        effect = CATALOGUE[name.partition(".")[0]]
        parameter, place = next(
            (q, k) for q, k in zip(effect.stated, effect.stated_indices, strict=True) if name.endswith(f".{q.name}")
        )
        found.append(Measured(name, float(p[place]), uncertainty, parameter.unit, 0.0, 0.0))
    return found
