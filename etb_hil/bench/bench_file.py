"""Bench files: the bus, the controller's DBC, and the safety limits.

They have roles, protection, and how the controller is asked.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.nearest import no_such
from etb_hil.base.quantity import Frequency, Ratio
from etb_hil.base.stock import find
from etb_hil.base.yamlfile import Document, FileModel, parse
from etb_hil.base.yamlfile import load as load_file
from etb_hil.bench.safety_limits import SafetyLimits
from etb_hil.canio.bus.bus_settings import VIRTUAL, BusSettings
from etb_hil.canio.dbc.dialect import Dialect
from etb_hil.canio.dbc.role_map import ProtectionSettings, RoleMap
from etb_hil.controller.laws.registry import LAWS
from etb_hil.observer.registry import DEFAULT, OBSERVERS
from etb_hil.plugins import load
from etb_hil.scenario.phase import Measure
from etb_hil.store.address import StoreText
from etb_hil.uds.settings import FRAMES, UdsSettings

ROUNDING = 1.0 - 1e-9  # of a time written in decimals


class Bench(FileModel):
    """One bench: a bus with a controller on it, and what the bench may do to a unit."""

    schema_: Annotated[Literal["etb_hil/bench/1"], Field(alias="schema")]
    name: Annotated[str, Field(min_length=1, max_length=80)]
    bus: BusSettings
    dbc: Annotated[str, Field(description="path, also beside this file, or the name of a stock DBC file")]
    roles: Annotated[RoleMap, Field(min_length=1)]
    protection: Annotated[ProtectionSettings, Field(default_factory=dict)]
    id_offset: Annotated[int, Field(ge=0, description="added to every arbitration id of the DBC file")] = 0
    command_rate: Annotated[Frequency, Field(ge=50, le=1000, description="set-points a second")] = 100.0
    measure: Annotated[Measure, Field(description="what the controller is asked to send")] = Measure()
    bus_share: Annotated[Ratio, Field(gt=0, le=1, description="largest share of the bus that may be planned")] = 0.8
    law: Annotated[
        str | None,
        Field(description="position law of the controller that a virtual bench has inside; pd where none is given"),
    ] = None
    plugins: Annotated[
        tuple[str, ...], Field(description="Python files with plug-ins; paths, also beside this file")
    ] = ()
    observer: Annotated[str, Field(description="the observer that estimates friction while a run goes on")] = DEFAULT
    uds: Annotated[UdsSettings | None, Field(description="how the unit's own diagnostics are asked")] = None
    store: StoreText | None = None
    limits: SafetyLimits

    @field_validator("observer")
    @classmethod
    def _is_an_observer(cls, name: str) -> str:
        if name not in OBSERVERS.names():
            raise ValueError(no_such("observer", name, OBSERVERS.names()))
        return name

    @field_validator("law")
    @classmethod
    def _is_a_law(cls, name: str | None) -> str | None:
        if name is not None and name not in LAWS.names():
            raise ValueError(no_such("control law", name, LAWS.names()))
        return name

    @model_validator(mode="after")
    def _has_a_law_of_its_own(self) -> Bench:
        if self.law is not None and self.bus.interface != VIRTUAL:
            raise ValueError("'law' is for virtual benches; start the controller of this bus with --law")
        return self

    @model_validator(mode="after")
    def _reads_no_faster_than_it_commands(self) -> Bench:
        for role, value in ({} if self.uds is None else self.uds.data).items():
            if value.read == "polled" and value.every * self.command_rate < ROUNDING:
                asked, least = value.every * 1e3, 1e3 / self.command_rate
                raise ValueError(
                    f"uds.data.{role}: every {asked:g} ms; allowed: from {least:g} ms on, since a request goes out "
                    "behind a set-point ('command_rate')"
                )
        return self

    @field_validator("roles", mode="before")
    @classmethod
    def _maps_a_role(cls, roles: object) -> object:
        if not roles:
            raise ValueError(
                "no role is mapped; write each below it, indented, as in '  motor_current: Message.Signal'"
            )
        return roles

    @field_validator("measure")
    @classmethod
    def _watches_everything(cls, measure: Measure) -> Measure:
        if len(set(measure.signals)) < 2:
            raise ValueError("a bench's usual request needs current and encoder: the plate moves on both")
        return measure


@dataclass(frozen=True, slots=True)
class BenchSetup:
    """A bench file with the DBC file that it names."""

    document: Document[Bench]
    dbc: Path
    dialect: Dialect

    @property
    def bench(self) -> Bench:
        """The contents of the file."""
        return self.document.content


def load_plugins(path: Path) -> None:
    """Take in the plug-ins that a bench file names.

    InputError says which one cannot be taken in, and why.

    To be called for files that the user names alone: it runs the code of the plug-ins. A session's copy of a bench file
    is read without.
    """
    data, lines = parse(path)
    for number, file in enumerate(_plugins_of(data, path)):
        if not file.is_file():
            place = Place(path, lines.get(("plugins", number)), f"plugins[{number}]")
            name = data["plugins"][number] if isinstance(data, dict) else None
            raise InputError(Problem("no such Python file", place, name, remedy="check the path"))
        load(file)


def files_named(path: Path) -> list[Path]:
    """Return the files that a bench file names: plug-ins, the DBC and a store.

    The bench file need not be right otherwise. InputError where it cannot be read.
    """
    data, _ = parse(path)
    names = [str(data[key]) for key in ("dbc", "store") if data.get(key)] if isinstance(data, dict) else []
    return [*_plugins_of(data, path), *map(Path, names), *(path.parent / name for name in names)]


def _plugins_of(data: object, path: Path) -> list[Path]:
    names = data.get("plugins") if isinstance(data, dict) else None
    return [path.parent / str(name) for name in names] if isinstance(names, list) else []


def load_bench(path: Path, dbc: Path | None = None) -> BenchSetup:
    """Read a bench file and its DBC (or the one given instead).

    InputError lists every problem with its place.
    """
    document = load_file(path, Bench)
    bench = document.content
    dbc = dbc or _dbc_of(document, path)
    dialect = Dialect.load(
        dbc,
        bench.roles,
        bench.protection,
        id_offset=bench.id_offset,
        place=document.place,
    )
    _refuse_shared_identifiers(document, dialect)
    return BenchSetup(document, dbc, _with_requested(document, dialect))


def _with_requested(document: Document[Bench], dialect: Dialect) -> Dialect:
    """Return the dialect with the roles that are read by data identifier.

    Roles that have a signal are refused.
    """
    uds = document.content.uds
    if uds is None or not uds.data:
        return dialect
    problems = [
        Problem(
            f"role '{role}' has a signal as well",
            document.place("uds", "data", role),
            dialect.source_of(role),
            remedy="read it by one of them: leave it out here, or in 'roles'",
        )
        for role in uds.data
        if dialect.has(role)
    ]
    if problems:
        raise InputError(*problems)
    return replace(dialect, requested=uds.requested())


def _refuse_shared_identifiers(document: Document[Bench], dialect: Dialect) -> None:
    uds = document.content.uds
    if uds is None:
        return
    problems = [
        Problem(
            f"message '{message.name}' has this identifier",
            document.place("uds", name),
            hex(message.ident),
            remedy="give the identifiers of the unit's diagnostic frames",
        )
        for name in FRAMES
        for message in dialect.messages
        if (message.ident, message.extended) == (getattr(uds, name), uds.extended)
    ]
    if problems:
        raise InputError(*problems)


def _dbc_of(document: Document[Bench], path: Path) -> Path:
    try:
        return find("dbc", document.content.dbc, beside=path)
    except InputError as error:
        place = document.place("dbc")
        raise InputError(*(replace(problem, place=place) for problem in error.problems)) from None
