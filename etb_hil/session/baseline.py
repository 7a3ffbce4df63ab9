"""A baseline: what a run is expected to find, made from a session.

Each number has a tolerance.

Limits say whether a unit is good; a baseline says whether something has changed, be it the unit, the bench or the
program. A difference therefore blames nobody: decision 0014.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, field_validator, model_validator

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.outcome import UnitVerdict
from etb_hil.base.quantity import dimension_of_unit, parse_quantity, tidy_unit, to_si
from etb_hil.base.yamlfile import Document, FileModel, load
from etb_hil.diagnosis.measurement_registry import kind_of
from etb_hil.results import shown
from etb_hil.scenario.phases import LOG

if TYPE_CHECKING:
    from etb_hil.results.measurement import Measurement
    from etb_hil.results.run_result import RunResult

LEAST = 0.02  # share of a value: the tolerance that a new baseline has at least, as well as the current's gain is known
OF_INTERVAL = 2.0  # half widths of the 95 % interval that it has at least: two such values differ by sqrt(2) of one


class Expected(FileModel):
    """A value with its unit, and how far from it is still the same.

    The distance is a share of it in %, or an amount in its unit.
    """

    value: Annotated[str, Field(description="value with its unit, as '0.171 N·m'; bare where it has none")]
    tolerance: Annotated[str, Field(description="as '5 %' of the value, or '0.01 N·m'")]

    @field_validator("value", "tolerance", mode="before")
    @classmethod
    def _as_text(cls, value: object) -> object:
        return str(value) if isinstance(value, int | float) and not isinstance(value, bool) else value

    @model_validator(mode="after")
    def _is_read(self) -> Expected:
        if not math.isfinite(self.si) or self.width <= 0.0:
            raise ValueError("'tolerance': a tolerance above 0 is expected, as '5 %'")
        return self

    @property
    def dimension(self) -> str:
        """Which quantity it is."""
        unit = self.value.strip().partition(" ")[2]
        dimension = dimension_of_unit(unit or "1")
        if dimension is None:
            raise ValueError(f"must have a known unit, as '0.171 N·m' has (got '{unit}')")
        return dimension

    @property
    def si(self) -> float:
        """The value in SI."""
        return parse_quantity(self.value, self.dimension)

    @property
    def width(self) -> float:
        """The tolerance in SI."""
        if self.tolerance.rstrip().endswith("%") and self.dimension != "ratio":
            return parse_quantity(self.tolerance, "ratio") * abs(self.si)
        zero = to_si(0.0, self.tolerance.strip().partition(" ")[2] or "1", self.dimension)  # of degrees Celsius
        return parse_quantity(self.tolerance, self.dimension) - zero


class Baseline(FileModel):
    """What is expected of a run.

    Its verdict where one is given, and numbers by the ids of `results.json`.
    """

    schema_: Annotated[Literal["etb_hil/baseline/1"], Field(alias="schema")]
    description: str = ""
    verdict: UnitVerdict | None = None
    numbers: Annotated[dict[str, Expected], Field(min_length=1)]


@dataclass(frozen=True, slots=True)
class Comparison:
    """One expectation and what was found, in words.

    `agrees` is None where the two cannot be compared.
    """

    name: str
    expected: str
    found: str
    agrees: bool | None

    def __str__(self) -> str:
        return f"{self.name}: expected {self.expected}, found {self.found}"


def load_baseline(path: Path) -> Document[Baseline]:
    """Read a baseline file.

    InputError lists every problem with file, line, key and value. A number whose measurement has another unit is one of
    them, as far as the measurement is known: plug-ins are taken in first.
    """
    baseline = load(path, Baseline)
    kinds = {name: kind_of(name) for name in baseline.content.numbers}
    units = {name: kind.unit for name, kind in kinds.items() if kind is not None}
    if wrong := [_wrong_unit(baseline, name, unit) for name, unit in units.items() if not _fits(baseline, name, unit)]:
        raise InputError(*wrong)
    return baseline


def compare(baseline: Document[Baseline], results: RunResult) -> list[Comparison]:
    """Hold the results of a run against a baseline.

    Return an entry for each expectation.

    Nobody knows the phases of a bare log: what is measured in single phases is not compared. A number that was
    measured in another unit than the baseline has does not agree: after a run nothing raises.
    """
    expected = baseline.content
    is_bare_log = {phase.name for phase in results.phases} == {LOG}
    entries = [
        _not_compared(baseline, name)
        if is_bare_log and name not in results.measurements and _is_of_phases(name)
        else _compared(baseline, name, results.measurements.get(name))
        for name in expected.numbers
    ]
    if expected.verdict is not None:
        verdict = results.unit.verdict
        said = "none" if verdict is None else str(verdict)
        entries.insert(0, Comparison("verdict", str(expected.verdict), said, verdict == expected.verdict))
    return entries


def _is_of_phases(name: str) -> bool:
    kind = kind_of(name)
    return kind is not None and bool(kind.phases)


def _wanted(baseline: Document[Baseline], name: str) -> str:
    entry = baseline.content.numbers[name]
    return f"{entry.value} within {entry.tolerance}"


def _not_compared(baseline: Document[Baseline], name: str) -> Comparison:
    return Comparison(name, _wanted(baseline, name), "not compared: a log has no phases", agrees=None)


def _compared(baseline: Document[Baseline], name: str, found: Measurement | None) -> Comparison:
    entry = baseline.content.numbers[name]
    wanted = _wanted(baseline, name)
    if found is None or found.value is None:
        said = "not measured" if found is None or not found.is_bound else shown.measured(found)
        return Comparison(name, wanted, said, agrees=False)
    said = f"{found.value:.6g} {found.unit}".removesuffix(" 1")
    is_near = abs(found.value - entry.si) <= entry.width
    return Comparison(name, wanted, said, _fits(baseline, name, found.unit) and is_near)


def _fits(baseline: Document[Baseline], name: str, unit: str) -> bool:
    """Return whether the baseline expects a number of the measured quantity."""
    return dimension_of_unit(unit) == baseline.content.numbers[name].dimension


def _wrong_unit(baseline: Document[Baseline], name: str, unit: str) -> Problem:
    place = baseline.place("numbers", name, "value")
    is_unknown = dimension_of_unit(unit) is None
    remedy = "leave it out: nothing is expected in this unit" if is_unknown else "correct the unit"
    return Problem(f"{name} is measured in {unit}", place, baseline.content.numbers[name].value, remedy=remedy)


def baseline_text(results: RunResult, description: str) -> str:
    """Return a baseline file that a run like this one agrees with.

    InputError where it measured nothing to expect.

    It has the measurements that come with a 95 % interval; each may be off by twice its half, or by 2 %, which is more.
    """
    lines = []
    for one in results.measurements.values():
        value, interval = one.value, one.interval
        if value is None or interval is None or dimension_of_unit(one.unit) is None:
            continue
        width = max(LEAST * abs(value), OF_INTERVAL * max(value - interval[0], interval[1] - value))
        if width > 0.0:
            unit = "" if one.unit == "1" else f" {tidy_unit(one.unit)}"
            lines.append(f"  {one.id}: {{value: {value:.6g}{unit}, tolerance: {width:.2g}{unit}}}\n")
    if not lines:
        raise InputError(
            Problem("this run measured no value with an interval", remedy="take a session that came to a verdict")
        )
    verdict = results.unit.verdict
    return (
        "# What a run is expected to find. Tolerance: twice the half of the 95 % interval, at least 2 % of the value;\n"
        "# narrow them to what you must not miss, widen them for what you do not mind, drop what you do not follow.\n"
        "schema: etb_hil/baseline/1\n"
        f"description: {description}\n" + (f"verdict: {verdict}\n" if verdict else "") + "numbers:\n" + "".join(lines)
    )
