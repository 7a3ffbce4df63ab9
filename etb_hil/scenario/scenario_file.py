"""Scenario files: the phases of a run in order, and groups that are repeated."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, model_validator

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.plugins import when_changed
from etb_hil.base.quantity import Voltage
from etb_hil.base.yamlfile import Document, FileModel, load
from etb_hil.scenario.condition import Condition
from etb_hil.scenario.phase import Name, PhaseModel, Repeat
from etb_hil.scenario.phases import AnyPhase, Phase

MOST_STEPS = 2000  # phases of a run, repeats counted
SUPPLY_HOLD_S = 0.05  # a dip of the supply that is shorter does nobody harm


class Group(FileModel):
    """Phases that are run one after another, several times over."""

    kind: Literal["group"]
    id: Annotated[Name, Field(description="name of the group, once a scenario")]
    repeat: Repeat = 1
    phases: Annotated[tuple[Entry, ...], Field(min_length=1, max_length=200)]


if TYPE_CHECKING:
    Entry = Phase | Group
else:
    Entry = Annotated[PhaseModel | Group, AnyPhase(Group)]


@dataclass(frozen=True, slots=True)
class Step:
    """A phase as it is run.

    Its id says how often its groups have been run; its key says where it stands in the file.
    """

    id: str
    phase: Phase
    key: tuple[str | int, ...]


class Retry(FileModel):
    """How often a run that gave no verdict on the unit is tried again.

    Every attempt is kept, and the last one counts.

    A unit that failed is never tried again: that would be testing until it passes.
    """

    attempts: Annotated[int, Field(ge=2, le=10, description="at most, the first one counted")]
    after: Annotated[tuple[Literal["inconclusive", "bench_fault"], ...], Field(min_length=1)] = ("inconclusive",)


class Scenario(FileModel):
    """What is done to a unit, phase by phase.

    Every run ends in the safe state, whatever the phases say.
    """

    schema_: Annotated[Literal["etb_hil/scenario/1"], Field(alias="schema")]
    name: Annotated[str, Field(min_length=1, max_length=80)]
    description: str = ""
    supply: Annotated[
        tuple[Voltage, Voltage] | None, Field(description="window of the supply; outside it the bench stops the run")
    ] = None
    retry: Retry | None = None
    phases: Annotated[tuple[Entry, ...], Field(min_length=1, max_length=200)]

    @model_validator(mode="after")
    def _is_possible(self) -> Scenario:
        if self.supply is not None and self.supply[0] >= self.supply[1]:
            raise ValueError("'supply': the first voltage must lie below the second")
        if (count := _count(self.phases)) > MOST_STEPS:
            raise ValueError(f"with all repeats there are {count} phases; allowed: up to {MOST_STEPS}")
        return self

    @property
    def steps(self) -> tuple[Step, ...]:
        """The phases in the order in which they are run, groups unrolled."""
        return tuple(_unrolled(self.phases, "", ("phases",)))

    @property
    def supply_guard(self) -> Condition | None:
        """The condition under which the supply stops the run."""
        if self.supply is None:
            return None
        window = tuple(f"{bound!r} V" for bound in self.supply)
        hold = f"{SUPPLY_HOLD_S!r} s"
        return Condition.model_validate({"role": "supply_voltage", "outside": window, "for": hold})


def _take_plugins() -> None:
    for model in (Group, Scenario):
        model.model_rebuild(force=True)


when_changed(_take_plugins)


def load_scenario(path: Path) -> Document[Scenario]:
    """Read a scenario file.

    InputError lists every problem with file, line, key and value.
    """
    document = load(path, Scenario)
    seen: set[str] = set()
    problems = []
    for name, key in _ids(document.content.phases, ("phases",)):
        if name in seen:
            place = document.place(*key, "id")
            problems.append(
                Problem("this phase id stands twice", place, name, remedy="give each phase a name of its own")
            )
        seen.add(name)
    if problems:
        raise InputError(*problems)
    return document


def _ids(entries: Iterable[Phase | Group], key: tuple[str | int, ...]) -> Iterator[tuple[str, tuple[str | int, ...]]]:
    for index, entry in enumerate(entries):
        yield entry.id, (*key, index)
        if isinstance(entry, Group):
            yield from _ids(entry.phases, (*key, index, "phases"))


def _count(entries: Iterable[Phase | Group]) -> int:
    return sum(entry.repeat * _count(entry.phases) if isinstance(entry, Group) else 1 for entry in entries)


def _unrolled(entries: Iterable[Phase | Group], before: str, key: tuple[str | int, ...]) -> Iterator[Step]:
    for index, entry in enumerate(entries):
        here = (*key, index)
        if isinstance(entry, Group):
            for turn in range(1, entry.repeat + 1):
                yield from _unrolled(entry.phases, f"{before}{entry.id}.{turn}.", (*here, "phases"))
        else:
            yield Step(f"{before}{entry.id}", entry, here)
