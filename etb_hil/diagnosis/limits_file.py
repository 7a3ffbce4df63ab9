"""Limits files: `limits` judges any measurement by its id.

Files of the first schema are read, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.nearest import did_you_mean
from etb_hil.base.quantity import Ratio, dimension_of_unit, format_quantity, parse_quantity
from etb_hil.base.yamlfile import Document, FileModel, load, parse
from etb_hil.diagnosis.limit_laws import DwellLaw, TemperatureLaw
from etb_hil.diagnosis.limits import Limit, Limits
from etb_hil.diagnosis.measurement_kind import MeasurementKind
from etb_hil.diagnosis.measurement_registry import kind_of, measurement_kinds
from etb_hil.plant.table_one import Shaft

Text = Annotated[str, Field(min_length=1, max_length=2000)]
Stated = Annotated[str | float | None, Field(description="a value with the unit of the measurement, as '0.26 N·m'")]
_HINT = "schema etb_hil/limits/1: write 'schema: etb_hil/limits/2' and the limits by id, 'limits: {T_st: {max: ...}}'"
_SIDES = ("min", "max")


class LimitEntry(FileModel):
    """What a measurement may be: at least `min`, at most `max`, or both.

    Torques are those at the shaft they are stated for.
    """

    min: Stated = None
    max: Stated = None
    shaft: Shaft = Shaft.THROTTLE
    temperature: Annotated[
        TemperatureLaw | None, Field(description="temperature moves friction more than wear does")
    ] = None
    dwell: Annotated[
        DwellLaw | None, Field(description="contacts grow while they rest: break-aways are judged by this law")
    ] = None
    source: Annotated[Text | None, Field(description="a standard, a data sheet, or 'chosen'")] = None


class LimitsFile(FileModel):
    """What is allowed of a part.

    Inside `marginal_band`, a share of each limit on either side of it, nothing is decided.
    """

    schema_: Annotated[Literal["etb_hil/limits/2"], Field(alias="schema")]
    part_number: Text
    revision: Text
    description: str = ""
    limits: Annotated[dict[str, LimitEntry], Field(min_length=1, description="by the id of a measurement")]
    marginal_band: Annotated[Ratio, Field(ge=0.0, lt=0.5)]


class _ShaftedEntry(LimitEntry):
    shaft: Shaft
    source: Text


class LimitsFile1(FileModel):
    """The first schema: limits of friction alone."""

    schema_: Annotated[Literal["etb_hil/limits/1"], Field(alias="schema")]
    part_number: Text
    revision: Text
    description: str = ""
    stiction: _ShaftedEntry
    coulomb: _ShaftedEntry
    return_margin: _ShaftedEntry
    marginal_band: Annotated[Ratio, Field(ge=0.0, lt=0.5)]


_OF_FIRST_SCHEMA = {"stiction": "T_st", "coulomb": "T_c", "return_margin": "return_margin"}


def load_limits(path: Path, gear_ratio: float | None = None) -> Limits:
    """Read a limits file.

    Raises InputError, which lists every problem with file, line, key and value. Limits that are stated for different
    shafts can be compared only where `gear_ratio` is known.
    """
    data, lines = parse(path)
    if isinstance(data, dict) and data.get("schema") == "etb_hil/limits/1":
        first = load(path, LimitsFile1)
        names = {id_: name for name, id_ in _OF_FIRST_SCHEMA.items()}
        entries: dict[str, LimitEntry] = {id_: getattr(first.content, name) for id_, name in names.items()}
        return _limits(first, entries, {id_: (name,) for id_, name in names.items()}, gear_ratio, _HINT)
    try:
        second = load(path, LimitsFile)
    except InputError as error:
        raise InputError(*error.problems, *_of_sound_entries(path, data, lines)) from None
    entries = second.content.limits
    return _limits(second, entries, {name: ("limits", name) for name in entries}, gear_ratio, "")


def _limits(
    document: Document[LimitsFile] | Document[LimitsFile1],
    entries: dict[str, LimitEntry],
    keys: dict[str, tuple[str, ...]],
    gear_ratio: float | None,
    hint: str,
) -> Limits:
    problems: list[Problem] = []
    found: dict[str, Limit] = {}
    for name, entry in entries.items():
        wrong = _problems_of(document, keys[name], name, entry)
        problems += wrong
        kind = kind_of(name)
        if kind is not None and not wrong:
            low, high = (_si(getattr(entry, side), kind) for side in _SIDES)
            source = entry.source or ""
            found[name] = Limit(low, high, entry.shaft, entry.temperature, entry.dwell, source)
    if not problems:
        problems += _exchanged(document, keys, found, gear_ratio)
    if problems:
        raise InputError(*problems)
    content = document.content
    return Limits(content.part_number, content.revision, content.marginal_band, found, hint)


def _of_sound_entries(path: Path, data: object, lines: dict[tuple[str | int, ...], int]) -> Iterator[Problem]:
    """Yield what is wrong with the entries of a file that has other problems, too."""
    limits = data.get("limits") if isinstance(data, dict) else None
    for name, stated in limits.items() if isinstance(limits, dict) else ():
        try:
            entry = LimitEntry.model_validate(stated)
        except ValidationError:
            continue  # is among the other problems
        yield from _problems_of(Document(path, entry, lines), ("limits", name), name, entry)


def _problems_of(document: Document[Any], key: tuple[str, ...], name: str, entry: LimitEntry) -> list[Problem]:
    """Return what is wrong with the entry of a measurement."""
    kind = kind_of(name)
    if kind is None:
        remedy = did_you_mean(name, measurement_kinds(), "see docs/reference/measurements.md for their ids")
        return [Problem("no measurement has this id", document.place(*key), name, remedy=remedy)]
    if not kind.has_interval:
        what = f"{kind.name} comes without an interval, so that no limit can be applied to it"
        remedy = (
            "take it out, or limit a measurement with an interval (docs/reference/measurements.md); --limits takes the "
            "place of a session's own"
        )
        return [Problem(what, document.place(*key), name, remedy=remedy)]
    return list(_wrong(document, key, kind, entry))


def _si(stated: str | float | None, kind: MeasurementKind) -> float | None:
    if stated is None:
        return None
    dimension = dimension_of_unit(kind.unit)
    if dimension is not None:
        return parse_quantity(stated, dimension)
    number, _, unit = str(stated).strip().partition(" ")
    if unit.strip() != kind.unit:
        raise ValueError(f"'{unit.strip()}' is not the unit; write the value in {kind.unit}")
    return parse_quantity(number, "ratio")


def _shown(value: float, kind: MeasurementKind) -> str:
    """Return a value with the unit of its measurement."""
    dimension = dimension_of_unit(kind.unit)
    return f"{value:.6g} {kind.unit}" if dimension is None else format_quantity(value, dimension)


def _wrong(
    document: Document[Any],
    key: tuple[str, ...],
    kind: MeasurementKind,
    entry: LimitEntry,
) -> Iterator[Problem]:
    """Yield what is wrong with the limit of a measurement."""
    stated = {side: getattr(entry, side) for side in _SIDES}
    values: dict[str, float] = {}
    for side, text in stated.items():
        try:
            value = _si(text, kind)
        except ValueError as error:
            yield Problem(str(error), document.place(*key, side), text)
            return
        if value is None:
            continue
        values[side] = value
        least = kind.least_limit if kind.least_limit is not None else (0.0 if kind.is_friction else -math.inf)
        if value < least or (kind.is_friction and value == least):
            allowed = f"{'above' if kind.is_friction else 'from'} {_shown(least, kind)}"
            yield Problem("out of range", document.place(*key, side), text, allowed)
    if not values:
        yield Problem("states no limit", document.place(*key), remedy=f"add 'max' or 'min' in {kind.unit}")
    if len(values) == len(_SIDES) and values["min"] >= values["max"]:
        what, allowed = "min must be less than max", f"below {_shown(values['max'], kind)}, the value of max"
        remedy = "lower min or raise max"
        yield Problem(what, document.place(*key, "min"), stated["min"], allowed, remedy)
    if entry.shaft is Shaft.MOTOR and kind.unit != "N·m":
        yield Problem("only a torque can be stated for the motor shaft", document.place(*key, "shaft"), "motor")
    if entry.temperature is not None and not kind.is_friction:
        yield Problem("only a limit of friction follows the temperature", document.place(*key, "temperature"))
    if entry.dwell is not None and not (kind.judged_at_rest_by or kind.id in _judge_at_rest()):
        yield Problem("only a limit of break-away follows the rest", document.place(*key, "dwell"))


def _judge_at_rest() -> frozenset[str]:
    """Return the measurements whose limits apply to a break-away from rest as well."""
    return frozenset(kind.judged_at_rest_by for kind in measurement_kinds().values())


def _exchanged(
    document: Document[LimitsFile] | Document[LimitsFile1],
    keys: dict[str, tuple[str, ...]],
    found: dict[str, Limit],
    gear_ratio: float | None,
) -> Iterator[Problem]:
    """Yield a problem where the limit of T_c lies above that of T_st.

    Then the two were exchanged.
    """
    stiction, coulomb = found.get("T_st"), found.get("T_c")
    if stiction is None or coulomb is None or (gear_ratio is None and stiction.shaft is not coulomb.shaft):
        return
    gear = gear_ratio or 1.0
    most, sliding = (one.at_throttle(gear)[1] for one in (stiction, coulomb))
    if most is None or sliding is None or sliding <= most:
        return
    factor = gear if coulomb.shaft is Shaft.MOTOR else 1.0  # each is said at the shaft that T_c is stated for
    yield Problem(
        "the limit of T_c lies above that of T_st: no throttle slides harder than it breaks away",
        document.place(*keys["T_c"], "max"),
        format_quantity(sliding / factor, "torque"),
        f"up to {format_quantity(most / factor, 'torque')}, the limit of T_st",
        "look whether the two were exchanged, and at their shafts",
    )
