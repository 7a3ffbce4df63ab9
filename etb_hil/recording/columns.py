"""Which column of a foreign table is which role.

Its own name with a unit says so, or a map file.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.nearest import did_you_mean
from etb_hil.base.quantity import DIMENSIONS, dimension_of_unit, tidy_unit, to_si
from etb_hil.base.roles import ROLES
from etb_hil.base.yamlfile import Document, FileModel

NS_PER_UNIT = {"ns": 1, "us": 1_000, "ms": 1_000_000, "s": 1_000_000_000, "min": 60_000_000_000, "h": 3_600_000_000_000}
MOST_VALUES = 1 << 25  # of a table, which is read as a whole: 268 MB, ten columns for an hour at 1 kHz
TIME_NAMES = ("time", "t")
_WRITTEN = {"pct": "%", "percent": "%", "": "1"}  # how units are spelled where no sign is allowed
_LONGEST_FIRST = sorted(ROLES, key=len, reverse=True)


def require_small(path: Path, rows: int, columns: int) -> None:
    """Raise InputError where so many rows and columns do not fit into memory."""
    if rows * columns > MOST_VALUES:
        what = f"has too many rows, {rows} or more, for {columns} columns"
        remedy = "give a part of it, or map fewer columns"
        raise InputError(Problem(what, Place(path), allowed=f"{MOST_VALUES // columns} rows", remedy=remedy))


class TimeColumn(FileModel):
    """The table's time: a column that increases, with its unit."""

    column: str
    unit: Literal["ns", "us", "ms", "s", "min", "h"]


class RoleColumn(FileModel):
    """One role's column: SI value = (number * scale + offset) in `unit`.

    With `optional` a table may lack it.
    """

    column: str
    unit: str = "1"
    scale: float = 1.0
    offset: float = 0.0
    optional: bool = False

    @field_validator("unit")
    @classmethod
    def _known(cls, unit: str) -> str:
        if dimension_of_unit(unit) is None:
            raise ValueError("must be a unit that etb_hil knows, such as deg, A or V")
        return tidy_unit(unit)


class TableMap(FileModel):
    """A map file: the columns of a foreign table by role."""

    schema_: Annotated[Literal["etb_hil/table_map/1"], Field(alias="schema")]
    time: TimeColumn
    roles: Annotated[dict[str, RoleColumn], Field(min_length=1)]

    @model_validator(mode="after")
    def _roles_and_units(self) -> TableMap:
        for name, use in self.roles.items():
            if name not in ROLES:
                raise ValueError(f"'{name}' must be a role; allowed: {', '.join(ROLES)}")
            if dimension_of_unit(use.unit) != _dimension(name):
                raise ValueError(f"{name}: '{use.unit}' does not fit; allowed: {_units(name)}")
        return self


@dataclass(frozen=True, slots=True)
class Conversion:
    """How a column becomes a role: SI value = number * factor + offset."""

    role: str
    column: str
    factor: float
    offset: float


@dataclass(frozen=True, slots=True)
class TablePlan:
    """What to read from a table."""

    time: TimeColumn
    roles: tuple[Conversion, ...]


def plan_by_map(document: Document[TableMap], file: Path, names: Sequence[str]) -> TablePlan:
    """Return the plan that a map file gives.

    InputError where the table lacks one of its columns.
    """
    table_map = document.content
    uses = {role: use for role, use in table_map.roles.items() if use.column in names or not use.optional}
    wanted: list[tuple[tuple[str, ...], str]] = [(("time", "column"), table_map.time.column)]
    wanted += [(("roles", role, "column"), use.column) for role, use in uses.items()]
    listed = ", ".join(names)
    missing = [
        Problem(f"{file} has no such column", document.place(*key), name, allowed=listed, remedy=_near(name, names))
        for key, name in wanted
        if name not in names
    ]
    if missing:
        raise InputError(*missing)
    return TablePlan(
        table_map.time,
        tuple(_conversion(role, use.column, use.unit, use.scale, use.offset) for role, use in uses.items()),
    )


def plan_by_names(
    file: Path, names: Sequence[str], line: int | None = None, called: Mapping[str, str] | None = None
) -> TablePlan:
    """Return the plan that names such as `t_ms, motor_voltage_V` give.

    A column that is no role is left out, unless its name is close to one: that is taken for a mistake. InputError names
    every column that cannot be read so. `called`: what columns are read as that state their unit apart.
    """
    times: list[TimeColumn] = []
    found: dict[str, Conversion] = {}
    problems = []
    for name in names:
        read_as = (called or {}).get(name, name)
        try:
            if (time := _time_by_name(read_as)) is not None:
                times.append(time.model_copy(update={"column": name}))
            elif (use := _role_by_name(read_as)) is not None:
                if use.role in found:
                    raise ValueError(f"'{found[use.role].column}' has the role {use.role} already")  # noqa: TRY301
                found[use.role] = replace(use, column=name)
        except ValueError as error:
            problems.append(Problem(str(error), Place(file, line, name), remedy="rename it or use a map file"))
    if not times:
        remedy = "name it like time_s or t_ms, or use a map file"
        problems.append(Problem("no column is the time", Place(file, line), ", ".join(names), remedy=remedy))
    elif len(times) > 1:
        both = ", ".join(time.column for time in times)
        problems.append(Problem("more than one column is the time", Place(file, line), both, remedy="use a map file"))
    if not found and not problems:
        remedy = "name columns by role and unit, like motor_voltage_V, or use a map file"
        problems.append(Problem("no column is a role", Place(file, line), ", ".join(names), remedy=remedy))
    if problems:
        raise InputError(*problems)
    return TablePlan(times[0], tuple(found.values()))


def is_named_as_signal(name: str) -> bool:
    """Return whether a name is that of the time or of a role, or is close to one."""
    try:
        return _time_by_name(name) is not None or _role_by_name(name) is not None
    except ValueError:
        return True


def _time_by_name(name: str) -> TimeColumn | None:
    for word in TIME_NAMES:
        unit = _unit_after(name, word)
        if unit in NS_PER_UNIT:
            return TimeColumn(column=name, unit=unit)  # type: ignore[arg-type]
        if unit is not None and (word == "time" or unit == "1"):
            raise ValueError(f"the time needs a unit; allowed: {', '.join(NS_PER_UNIT)}")
    return None


def _role_by_name(name: str) -> Conversion | None:
    for role in _LONGEST_FIRST:
        unit = _unit_after(name, role)
        if unit is not None:
            if dimension_of_unit(unit) != _dimension(role):
                wrong = "needs a unit" if unit == "1" else f"must be a unit of the role {role} (got '{unit}')"
                raise ValueError(f"{wrong}; allowed: {_units(role)}")
            return _conversion(role, name, unit)
    near = difflib.get_close_matches(re.sub(r"_[^_]*\Z", "", name), ROLES, n=1, cutoff=0.85)
    if near:
        raise ValueError(f"must be a role; did you mean '{near[0]}'?")
    return None


def _unit_after(name: str, word: str) -> str | None:
    """Return the unit in `word_unit` or `word [unit]`.

    The unit is `1` where there is none, None where the name is another word.
    """
    match = re.fullmatch(rf"{re.escape(word)}(?:_(\S+)|\s*[\[(]\s*(.*?)\s*[\])])?", name.strip())
    if match is None:
        return None
    written = match[1] or match[2] or ""
    unit = _WRITTEN.get(written, written)
    for spelling in (unit, unit.replace("_per_", "/"), unit.replace("_", "/")):
        if dimension_of_unit(spelling) is not None or spelling in NS_PER_UNIT:
            return tidy_unit(spelling)
    # throttle_angle_2_deg is not throttle_angle in `2_deg`; longer roles were tried before
    return unit


def _conversion(role: str, column: str, unit: str, scale: float = 1.0, offset: float = 0.0) -> Conversion:
    dimension = _dimension(role)
    zero = to_si(0.0, unit, dimension)
    factor = to_si(1.0, unit, dimension) - zero if zero else to_si(1.0, unit, dimension)
    return Conversion(role, column, factor * scale, factor * offset + zero)


def _dimension(role: str) -> str:
    return dimension_of_unit(ROLES[role].unit) or "ratio"


def _units(role: str) -> str:
    return ", ".join(DIMENSIONS[_dimension(role)][1])


def _near(name: str, names: Sequence[str]) -> str:
    return did_you_mean(name, names) or "correct the map file"
