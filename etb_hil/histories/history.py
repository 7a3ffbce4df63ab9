"""The history of a part: its runs, and what they say number by number.

The history speaks of units, of production, and of benches.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.diagnosis.measurement_registry import kind_of, measurement_kinds, name_of
from etb_hil.histories.capability import Capability, capability
from etb_hil.histories.control_chart import ControlChart, control_chart
from etb_hil.histories.distribution import Distribution, distribution
from etb_hil.histories.drift import Drift, Point, deviations, drifts, series_of
from etb_hil.histories.gauge import GaugeStudy, balanced, gauge_study
from etb_hil.histories.rise import Rises, rises
from etb_hil.histories.rounding import scatters
from etb_hil.histories.temperature import LEAST_SPREAD, REFERENCE, TemperatureEffect, unit_laws
from etb_hil.histories.tolerance import tolerance_limit
from etb_hil.recording.samples import Float64
from etb_hil.store.run import Run

Limits = tuple[float | None, float | None]  # the lower and the upper one
FRICTION = ("T_st", "T_c")  # what the table of runs and the plots over temperature show


@dataclass(frozen=True, slots=True)
class NumberHistory:
    """A measurement over the runs that count, in its SI `unit`.

    `values` (n) as measured, `compared` (n) without temperature where known.

    `compared` is NaN where the law does not carry to 20 degC, and may be off by `uncertainty` (n) where it does, 95 %.
    `at` (n) is each value's place among the part's runs. `charted` are the units of the control chart, in order of
    their latest runs, one value a unit. `shape` is their distribution: on it rest the capability and `tolerance_limit`,
    which less than 1 % of such units exceed, with 95 % confidence. What the runs cannot tell is None.
    `differing_limits` are those that the runs state, without repeats, where none of them applies to all charted
    values: `limit_low` and `limit_high` are None then.
    """

    id: str
    name: str
    unit: str
    at: list[int]
    values: Float64
    compared: Float64
    uncertainty: Float64
    temperature: TemperatureEffect | None
    charted: list[str]
    chart: ControlChart | None
    shape: Distribution | None
    tolerance_limit: float | None
    capability: Capability | None
    limit_low: float | None
    limit_high: float | None
    gauge: GaugeStudy | None
    drifts: list[Drift]
    looked_at: int
    rises: Rises | None
    differing_limits: list[Limits]


@dataclass(frozen=True, slots=True)
class History:
    """All runs of one part under one scenario, and each number's history."""

    part_number: str
    revision: str
    scenario: str
    runs: list[Run]
    numbers: list[NumberHistory]

    @property
    def units(self) -> int:
        """How many units the runs are of; a run without a serial number is one of its own."""
        return len({_unit_of(run) for run in self.runs})

    def at_reference(self, number: NumberHistory) -> dict[int, tuple[float, float]]:
        """Return a number's values at 20 degC by their runs' places.

        The second result is by how much they may be off for that.

        Without a law, those are left that were measured at just that temperature.
        """
        known = zip(number.at, number.compared.tolist(), number.uncertainty.tolist(), strict=True)
        is_known = number.temperature is not None
        return {k: (value, off) for k, value, off in known if is_known or self.runs[k].temperature == REFERENCE}


def histories(runs: Sequence[Run]) -> list[History]:
    """Return a history for each part, revision and scenario.

    What was measured differently is not compared.

    Raises InputError where there is no run.
    """
    groups: dict[tuple[str, str, str], list[Run]] = {}
    for run in runs:
        groups.setdefault((run.part_number, run.revision, run.scenario), []).append(run)
    if not groups:
        raise InputError(Problem("there is no finished run", remedy="name a folder of sessions that has some"))
    return [History(*key, group, _numbers(group)) for key, group in sorted(groups.items())]


def _unit_of(run: Run) -> str:
    """Return the name of a run's unit: its serial number, or that of the run.

    A run without a serial number is a unit of its own: nobody knows whether it came again.
    """
    return run.serial or f"run {run.run_id}"


def _numbers(runs: list[Run]) -> list[NumberHistory]:
    """Return the history of T_st, T_c, and everything that a limit applied to.

    The order is that of declaration.
    """
    judged = {name for run in runs for name, one in run.numbers.items() if one.has_limit}
    found: dict[str, NumberHistory] = {}
    points: dict[str, list[Point]] = {}
    for name in (*measurement_kinds(), *sorted(judged - measurement_kinds().keys())):
        if name in judged or name in FRICTION:
            found[name], points[name] = _number(name, runs, found)
    series = sum(number.looked_at for number in found.values())  # which share one chance of false alarm
    return [
        replace(number, drifts=drifts(points[name], series - number.looked_at)[0]) for name, number in found.items()
    ]


def _number(name: str, runs: list[Run], others: Mapping[str, NumberHistory]) -> tuple[NumberHistory, list[Point]]:
    """Return the history of a measurement, and the points that tell its drifts.

    Friction follows the temperature by a law of its own, which is taken out; what friction is a part of has that part's
    temperature taken out; all others are compared as measured.
    """
    kind = measurement_kinds().get(name)
    is_friction = kind is not None and kind.is_friction
    stiction = None if kind is None else others.get(kind.friction_of)
    at = [k for k, run in enumerate(runs) if run.counts and name in run.numbers]
    values = np.array([runs[k].numbers[name].value for k in at])
    warmth = np.array([np.nan if runs[k].temperature is None else runs[k].temperature for k in at], dtype=np.float64)
    units = [_unit_of(runs[k]) for k in at]
    laws = unit_laws(values, warmth, units)
    if stiction is None:
        effect = laws.together() if is_friction else None
        compared = values if effect is None else effect.taken_out(values, warmth)
        uncertainty = np.zeros(len(at)) if effect is None else compared * effect.uncertainty(warmth - REFERENCE)
    else:
        effect = stiction.temperature
        moved = np.full((2, len(runs)), np.nan)
        moved[:, stiction.at] = stiction.values - stiction.compared, stiction.uncertainty
        compared, uncertainty = values + moved[0, at], moved[1, at]
    sound = np.flatnonzero(np.isfinite(compared))
    latest = {units[k]: int(k) for k in sound}
    charted = sorted(latest, key=lambda unit: latest[unit])
    of_units = compared[[latest[unit] for unit in charted]]
    declared = kind_of(name)
    is_torque = declared is not None and declared.is_friction
    chart = control_chart(of_units, 0.0 if is_torque else -math.inf)
    shape = distribution(of_units, by_shares=is_torque)
    stated = [(runs[k].numbers[name].limit_low, runs[k].numbers[name].limit_high) for k in at]
    if effect is None:
        (low, high), differing = _limits_of([stated[latest[unit]] for unit in charted])
    else:
        (low, high), differing = _limits_at_reference(stated, warmth)
    # The law is one for all: where it errs, it moves all units the same way.
    unsure = np.sign(warmth - REFERENCE) * uncertainty if effect is not None else uncertainty
    common = abs(float(unsure[[latest[unit] for unit in charted]].mean())) if charted else 0.0
    cells: dict[tuple[str, str], list[float]] = {}
    for k in sound:
        cells.setdefault((units[k], runs[at[k]].bench), []).append(float(compared[k]))
    study = balanced(cells)
    time = np.array([runs[at[k]].at.timestamp() for k in sound])
    names, benches = [units[k] for k in sound], [runs[at[k]].bench for k in sound]
    points = deviations(time, compared[sound], names, benches)
    risen = None
    if is_friction:
        risen = rises([runs[k].started for k in at], values, warmth, units, laws)
    return NumberHistory(
        name, name_of(name), _unit(name, runs), at, values, compared, uncertainty, effect, charted, chart, shape,
        tolerance_limit(shape) if is_friction else None,
        None if chart is None else capability(chart, shape, low, high, common), low, high,
        None if study is None or not scatters(study[2]) else gauge_study(study[2]), [], series_of(points), risen,
        differing,
    ), points  # fmt: skip


def _unit(name: str, runs: Sequence[Run]) -> str:
    """Return the SI unit of a measurement, by declaration or by its runs."""
    kind = measurement_kinds().get(name)
    return kind.unit if kind is not None else next(run.numbers[name].unit for run in runs if name in run.numbers)


def _limits_of(stated: Sequence[Limits]) -> tuple[Limits, list[Limits]]:
    """Return the limits of values compared as measured, and those that differ.

    A limit applies where the run of every charted value states it (`stated`, n). One that follows the temperature, or
    was changed, would be too wide or too narrow for the others.
    """
    distinct = list(dict.fromkeys(stated))
    return (distinct[0], []) if len(distinct) == 1 else ((None, None), distinct)


def _limits_at_reference(stated: Sequence[Limits], warmth: Float64) -> tuple[Limits, list[Limits]]:
    """Return the limits of values brought to 20 degC, and those that differ.

    They are the latest of those stated (n) within 5 K of it, at temperatures `warmth` (n) in degC.
    """
    distinct = list(dict.fromkeys(stated))
    if len(distinct) == 1:
        return distinct[0], []
    near = [limit for limit, at in zip(stated, warmth, strict=True) if abs(at - REFERENCE) <= LEAST_SPREAD]
    return (near[-1], []) if near else ((None, None), distinct)
