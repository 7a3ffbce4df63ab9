"""Everything that is refused before anything moves.

These are set-points beyond the bench's limits, missing roles, and a bus without room.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from operator import attrgetter
from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.modes import Mode
from etb_hil.base.quantity import format_quantity
from etb_hil.bench.controller_needs import missing_roles, says_too_little, unsendable
from etb_hil.bench.rehearsal import TEMPERATURE_MARGIN
from etb_hil.canio.bus.budget import bus_budget
from etb_hil.controller.machine import AMBIENT_C
from etb_hil.scenario.phase import Measure
from etb_hil.scenario.phases import Phase
from etb_hil.scenario.trajectory import Chain, Held, Motion, Released

if TYPE_CHECKING:
    from etb_hil.base.yamlfile import Document
    from etb_hil.bench.bench_file import Bench, BenchSetup
    from etb_hil.bench.safety_limits import SafetyLimits
    from etb_hil.canio.bus.budget import BusBudget
    from etb_hil.canio.dbc.dialect import Dialect
    from etb_hil.plant.values import ThrottleParameters
    from etb_hil.scenario.scenario_file import Scenario
    from etb_hil.scenario.trajectory import SetPoint, Trajectory

KELVIN = 273.15  # of 0 degC
SAMPLE_S = 0.001  # set-points of no known extremes are looked at this often
_ROUNDING = 1e-9  # in SI units: a motion's end is the sum of its ways
_PART = 1000  # set-points held at a time: a phase may last for hours


def check_scenario(scenario: Document[Scenario], setup: BenchSetup, throttle: ThrottleParameters) -> list[BusBudget]:
    """Hold every phase against the bench's limits, its roles and its bus.

    Return the budget of each kind of request.

    Raises InputError with every problem found, each with file, line, key, value and what is allowed.
    """
    bench, dialect = setup.bench, setup.dialect
    roles = setup.document.place("roles")
    problems = list(missing_roles(dialect, roles)) or list(says_too_little(dialect, roles))
    is_told = not problems
    problems += _below_any_housing(setup)
    total = 0.0
    start = throttle.limp_home
    looked_at: set[tuple[object, ...]] = set()  # a repeated phase has the same problems each time
    steps = iter(scenario.content.steps)
    for step in steps:
        phase, where = step.phase, _Where(scenario, step.key)
        trajectory = phase.trajectory(start, throttle)
        total += trajectory.duration
        if (*step.key, start) not in looked_at:
            looked_at.add((*step.key, start))
            found = [
                *_wrong_by_itself(phase, bench.limits, dialect, where),
                *_never_fires(phase, trajectory, where),
                *_moves_unseen(phase, trajectory, where),
            ]
            if not found and total <= bench.limits.duration:
                points = _points(trajectory)
                found = [*_strays(points, bench.limits, where)]
                found += unsendable(points, dialect, where()) if is_told and not found else ()
            problems += [problem for problem in found if problem not in problems]
        if total > bench.limits.duration:
            break
        last = trajectory.at(trajectory.duration)
        start = last.position if last.enable else throttle.limp_home
    if total > bench.limits.duration:
        rest = {later.key: later.phase for later in steps}  # no set-points of these: there may be very many
        for key, phase in rest.items():
            found = [*_wrong_by_itself(phase, bench.limits, dialect, _Where(scenario, key))]
            problems += [problem for problem in found if problem not in problems]
        taken = f"{total:.1f} s" + (f" up to the end of '{step.id}', and more follows" if rest else "")
        allowed = f"up to {bench.limits.duration:g} s (the bench's limit)"
        problems.append(Problem("the scenario takes too long", scenario.place("phases"), taken, allowed, "shorten it"))
    if scenario.content.supply is not None and not dialect.has("supply_voltage"):
        problems.append(_no_such_signal("supply_voltage", scenario.place("supply")))
    if problems:
        raise InputError(*problems)
    try:
        return [bus_budget_of(bench, measure, dialect) for measure in _requests(bench, scenario.content)]
    except InputError as error:  # the sum does not know which file asked for it
        bus = setup.document.place("bus")
        raise InputError(*(replace(problem, place=problem.place or bus) for problem in error.problems)) from None


def _below_any_housing(setup: BenchSetup) -> Iterator[Problem]:
    """Find a limit of temperature that a unit exceeds before it moves.

    Most often it is in K; the unit is the dry run's.
    """
    limit, least = setup.bench.limits.temperature, AMBIENT_C + TEMPERATURE_MARGIN
    if limit <= least:
        yield Problem(
            "a unit at rest exceeds this limit",
            setup.document.place("limits", "temperature"),
            f"{limit:g} degC",
            f"above {least:g} degC: the dry run begins at {AMBIENT_C:g} degC and keeps a margin",
            f"raise it, or correct its unit: {limit + KELVIN:g} K are {limit:g} degC",
        )


def bus_budget_of(bench: Bench, measure: Measure, dialect: Dialect) -> BusBudget:
    """Return what a measurement request puts on the bench's bus.

    InputError with the sum where it does not fit.
    """
    return bus_budget(
        dialect,
        bench.bus,
        command_rate=bench.command_rate,
        signals=measure.signals,
        sample_rate=measure.rate,
        burst=measure.burst,
        limit=bench.bus_share,
    )


def _shown(value: float, dimension: str, digits: int = 6) -> str:
    """Write a value as people write it: angles in degrees."""
    if dimension == "angle":
        return f"{math.degrees(value):.{digits}g} deg"
    return format_quantity(value, dimension, digits)


class _Where:
    def __init__(self, scenario: Document[Scenario], step: tuple[str | int, ...]) -> None:
        self._scenario, self._step = scenario, step

    def __call__(self, *key: str | int) -> Place:
        return self._scenario.place(*self._step, *key)


def _wrong_by_itself(phase: Phase, limits: SafetyLimits, dialect: Dialect, where: _Where) -> Iterator[Problem]:
    """Find what is wrong with a phase wherever in the scenario it stands."""
    yield from _outside(phase, limits, where)
    yield from _unknown_roles(phase, dialect, where)


def _outside(phase: Phase, limits: SafetyLimits, where: _Where) -> Iterator[Problem]:
    """Find values of a phase that lie outside the bench's limits by themselves."""
    low, high = limits.angle
    angles = f"{_shown(low, 'angle', 4)} to {_shown(high, 'angle', 4)} (the bench's limit)"
    for place, angle in _values(phase, phase.angles, where):
        if not low <= angle <= high:
            shown = _shown(angle, "angle")
            yield Problem("the angle is outside the bench's limits", place, shown, angles, "choose one inside")
    for place, speed in _values(phase, phase.speeds, where):
        if speed > limits.velocity:
            shown = _shown(speed, "angular velocity")
            allowed = f"up to {_shown(limits.velocity, 'angular velocity')} (the bench's limit)"
            yield Problem("the velocity is outside the bench's limits", place, shown, allowed, "choose a lower one")


def _values(phase: Phase, keys: tuple[str, ...], where: _Where) -> Iterator[tuple[Place, float]]:
    """Yield the values of some keys, lists value by value, each with its place."""
    for key in keys:
        value = getattr(phase, key)
        if isinstance(value, tuple):
            yield from ((where(key, index), each) for index, each in enumerate(value))
        elif value is not None:
            yield where(key), value


def _unknown_roles(phase: Phase, dialect: Dialect, where: _Where) -> Iterator[Problem]:
    """Find conditions on signals that this bench does not have."""
    if phase.until is not None and not dialect.has(phase.until.role):
        yield _no_such_signal(phase.until.role, where("until", "role"))


def _never_fires(phase: Phase, trajectory: Trajectory, where: _Where) -> Iterator[Problem]:
    """Find a condition that would have to hold for longer than its phase lasts."""
    if phase.until is None:
        return
    needed, lasts = phase.until.for_ + (phase.until.over or 0.0), trajectory.duration
    if needed >= lasts:
        key = "over" if phase.until.for_ == 0.0 else "for"
        allowed = f"less than {lasts:g} s, which is what the phase lasts"
        yield Problem(
            "the condition cannot come true in time", where("until", key), f"{needed:g} s", allowed, "shorten it"
        )


def _no_such_signal(role: str, place: Place) -> Problem:
    return Problem("this bench has no signal for the role", place, role, remedy="map the role in the bench file")


def _moves_unseen(phase: Phase, trajectory: Trajectory, where: _Where) -> Iterator[Problem]:
    """Find a phase that drives the plate and does not ask for both current and angle."""
    driven = any(trajectory.at(share * trajectory.duration).enable for share in (0.0, 0.25, 0.5, 0.75))
    if driven and phase.measure is not None and len(set(phase.measure.signals)) < 2:
        yield Problem(
            "the plate would move without being watched",
            where("measure", "signals"),
            ", ".join(phase.measure.signals),
            "current and encoder, in a phase that drives",
            "ask for both",
        )


def _points(trajectory: Trajectory) -> list[SetPoint]:
    """Return the set-points that are farthest out, of each mode.

    A phase of hours has too many to keep them all.
    """
    farthest: list[SetPoint] = []
    coming = _all_points(trajectory)
    while part := list(islice(coming, _PART)):
        by_mode = {mode: [point for point in (*farthest, *part) if point.mode is mode] for mode in Mode}
        farthest = [
            end(points, key=attrgetter(name))
            for points in by_mode.values()
            if points
            for end in (min, max)
            for name in ("position", "velocity", "voltage")
        ]
    return farthest


def _all_points(trajectory: Trajectory) -> Iterator[SetPoint]:
    if isinstance(trajectory, Chain):
        for part in trajectory.parts:
            yield from _all_points(part)
    elif isinstance(trajectory, Released | Held):
        yield trajectory.at(0.0)
    elif isinstance(trajectory, Motion):
        yield from trajectory.extremes
    else:
        yield from (trajectory.at(i * SAMPLE_S) for i in range(int(trajectory.duration / SAMPLE_S) + 1))


def _strays(points: list[SetPoint], limits: SafetyLimits, where: _Where) -> Iterator[Problem]:
    """Find set-points on the way that leave the limits.

    Each value of the phase may be inside.
    """
    driven = [point for point in points if point.enable]
    low, high = limits.angle
    for what, dimension, worst, least, most in (
        ("angle", "angle", min((p.position for p in driven), default=low), low, high),
        ("angle", "angle", max((p.position for p in driven), default=high), low, high),
        ("velocity", "angular velocity", max((abs(p.velocity) for p in driven), default=0.0), 0.0, limits.velocity),
        ("voltage", "voltage", max((abs(p.voltage) for p in driven), default=0.0), 0.0, limits.voltage),
    ):
        if not least - _ROUNDING <= worst <= most + _ROUNDING:
            allowed = f"{_shown(least, dimension, 4)} to {_shown(most, dimension, 4)}"
            yield Problem(
                f"the phase's set-points leave the bench's limits of {what}",
                where(),
                _shown(worst, dimension),
                f"{allowed} (the bench's limit)",
                "change the phase's angles, speeds or times",
            )


def _requests(bench: Bench, scenario: Scenario) -> list[Measure]:
    asked = [bench.measure, *(step.phase.measure for step in scenario.steps if step.phase.measure is not None)]
    return list({request.model_dump_json(): request for request in asked}.values())
