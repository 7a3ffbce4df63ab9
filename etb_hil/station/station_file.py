"""Station files: parts, limits, serial numbers, re-tests and the bench's fitness.

Golden unit and calibrations say whether the bench is fit; a file says how long sessions are kept, too.
"""

from __future__ import annotations

import re
from datetime import date
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema, field_validator, model_validator

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.outcome import UnitVerdict
from etb_hil.base.quantity import Duration, Torque
from etb_hil.base.stock import find
from etb_hil.base.yamlfile import Document, FileModel, load
from etb_hil.scenario.judged_limits import load_judged_limits
from etb_hil.station.serial_pattern import LONGEST, check_serial_pattern
from etb_hil.store.address import StoreText

Text = Annotated[str, Field(min_length=1, max_length=200)]


def _date(value: object) -> date:
    if not isinstance(value, str):
        raise ValueError("a date is expected, for instance 2027-03-01")  # noqa: TRY004 (pydantic wants it)
    try:
        return date.fromisoformat(value)
    except ValueError:
        raise ValueError("no date; write it as 2027-03-01") from None


Date = Annotated[date, BeforeValidator(_date), WithJsonSchema({"type": "string", "format": "date"})]


class Part(FileModel):
    """A part that the station tests, as somebody approved it.

    Files are named by path, also beside this file, or as stock ones.
    """

    number: Text
    revision: Text
    approver: Annotated[Text, Field(description="who approved limits and model for this revision, and when")]
    serial: Annotated[Text, Field(description="regular expression that the whole serial number matches")]
    limits: Text
    model: Text
    scenario: Text = "friction_check"
    software: Annotated[Text | None, Field(description="what the unit itself says of its software, by UDS")] = None
    clear_trouble_codes: Annotated[
        bool, Field(description="whether the unit's own trouble codes are cleared before a run, after they were read")
    ] = False
    dbc: Annotated[Text | None, Field(description="instead of the one that the bench file names")] = None

    @field_validator("serial")
    @classmethod
    def _is_a_pattern(cls, text: str) -> str:
        check_serial_pattern(text)
        return text

    def takes(self, serial: str) -> bool:
        """Return whether a serial number is one of this part's."""
        return len(serial) <= LONGEST and re.fullmatch(self.serial, serial) is not None


class Retest(FileModel):
    """When a unit may come again: after which verdicts, and how often at most.

    A run that judged nothing (bench fault, aborted) never counts.
    """

    after: tuple[UnitVerdict, ...] = (UnitVerdict.INCONCLUSIVE,)
    most: Annotated[int, Field(ge=1, le=100, description="runs that judged it, the first one included")] = 2


class Expected(FileModel):
    """What a number of the golden unit has to be, at the throttle shaft."""

    value: Torque
    within: Annotated[Torque, Field(gt=0)]


class Golden(FileModel):
    """A unit whose friction is known.

    Measured every so often, it says whether the bench still measures rightly.
    """

    serial: Text
    part: Annotated[Text, Field(description="number of the part that it is")]
    every: Annotated[Duration, Field(gt=0)]
    expect: Annotated[dict[Literal["T_st", "T_c", "return_margin"], Expected], Field(min_length=1)]


class Calibration(FileModel):
    """A calibrated thing of the bench, and the last day on which it may be used."""

    of: Text
    certificate: Text
    due: Date


class Retention(FileModel):
    """How long sessions are kept; their numbers stay in the store of results."""

    passed: Annotated[Duration, Field(gt=0)]
    other: Annotated[Duration, Field(gt=0, description="failed, inconclusive, faulted and killed runs")]

    @model_validator(mode="after")
    def _failures_stay_longer(self) -> Retention:
        if self.other < self.passed:
            raise ValueError("what did not pass is kept as long as what passed, at the least")
        return self


class Station(FileModel):
    """A bench, the parts it tests, and its rules."""

    schema_: Annotated[Literal["etb_hil/station/1"], Field(alias="schema")]
    name: Text
    bench: Text
    parts: Annotated[tuple[Part, ...], Field(min_length=1)]
    retest: Retest = Retest()
    golden: Golden | None = None
    calibration: tuple[Calibration, ...] = ()
    retention: Retention | None = None
    store: StoreText | None = None

    def part(self, number: str) -> Part | None:
        """Return a part by its number."""
        return next((part for part in self.parts if part.number == number), None)

    def parts_of(self, serial: str) -> list[Part]:
        """Return the parts that a unit can be, by its serial number.

        The golden unit is what the file says.
        """
        if self.golden is not None and serial == self.golden.serial:
            return [part for part in self.parts if part.number == self.golden.part]
        return [part for part in self.parts if part.takes(serial)]


def load_station(path: Path) -> Document[Station]:
    """Read a station file, and check that its files are there and of their parts.

    InputError lists every problem with file, line, key and value.
    """
    document = load(path, Station)
    station = document.content
    problems: list[Problem] = []
    numbers = [part.number for part in station.parts]
    for index, part in enumerate(station.parts):
        if numbers.index(part.number) != index:
            problems.append(Problem("the part is there twice", document.place("parts", index, "number"), part.number))
        problems += _wrong_files(document, index, part)
    if station.golden is not None and station.golden.part not in numbers:
        allowed = ", ".join(numbers)
        problems.append(Problem("no such part", document.place("golden", "part"), station.golden.part, allowed))
    if problems:
        raise InputError(*problems)
    return document


def _wrong_files(document: Document[Station], index: int, part: Part) -> list[Problem]:
    problems: list[Problem] = []
    for kind in ("limits", "model", "scenario", "dbc"):
        name = getattr(part, kind)
        try:
            path = None if name is None else find(kind, name, beside=document.path)
            if kind == "limits" and path is not None:
                limits = load_judged_limits(path)
                if (limits.part_number, limits.revision) != (part.number, part.revision):
                    problems.append(
                        Problem(
                            "the limits are of another part",
                            document.place("parts", index, "limits"),
                            f"{limits.part_number} revision {limits.revision}",
                            f"{part.number} revision {part.revision}",
                            "name the limits that were approved for this revision",
                        )
                    )
        except InputError as error:
            place = document.place("parts", index, kind)
            problems += [Problem(p.what, p.place or place, p.value, p.allowed, p.remedy) for p in error.problems]
    return problems
