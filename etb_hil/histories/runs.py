"""Runs of the past: read from a store of results, from folders of sessions, or from both."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.base.userfile import require_file
from etb_hil.results.run_result import RunResult
from etb_hil.session.session import MANIFEST, RESULTS, open_session
from etb_hil.session.store import STORE

TEMPERATURE = "temperature"
_Row = tuple[float | None, float | None, float | None, float | None, float | None, str]
_LARGEST = 1e100  # of a value in SI units: squares of it are numbers still
_UNDECIDED = ("_undecided", "_without_interval")  # a sound measurement that its limit does not decide


@dataclass(frozen=True, slots=True)
class Measured:
    """A number of a run in SI units, with its 95 % interval and its limits; None where there is none."""

    value: float
    low: float | None
    high: float | None
    limit_low: float | None
    limit_high: float | None
    unit: str = "N·m"

    @property
    def has_limit(self) -> bool:
        """Whether a limit applied to it."""
        return self.limit_low is not None or self.limit_high is not None


@dataclass(frozen=True, slots=True)
class Run:
    """A finished run; `numbers` by id, `temperature` of the housing in degC."""

    run_id: str
    started: str
    bench: str
    scenario: str
    serial: str
    part_number: str
    revision: str
    bench_outcome: str
    verdict: str | None
    reason_id: str
    temperature: float | None
    numbers: Mapping[str, Measured]

    @property
    def counts(self) -> bool:
        """Whether its numbers were measured soundly: a bench fault or a withheld verdict says nothing of a unit."""
        if self.bench_outcome != BenchOutcome.OK or self.verdict is None:
            return False
        return self.verdict != UnitVerdict.INCONCLUSIVE or self.reason_id.endswith(_UNDECIDED)


def read_runs(sources: Iterable[Path]) -> tuple[list[Run], list[str]]:
    """Return the finished runs of stores, sessions and folders of sessions in order of time, and what was left out.

    A run that several sources hold counts once. Raises InputError where a source is none of these.
    """
    found: dict[str, Run] = {}
    notes: list[str] = []
    for source in sources:
        before = len(found)
        for run in _of_source(source, notes):
            found.setdefault(run.run_id, run)
        if len(found) == before:
            notes.append(f"{source}: no finished run that was not read before")
    return sorted(found.values(), key=lambda run: (run.started, run.run_id)), notes


def _of_source(source: Path, notes: list[str]) -> Iterator[Run]:
    if (source / MANIFEST).is_file():
        yield from _of_sessions([source], notes)
    elif source.is_dir():
        if (source / STORE).is_file():
            yield from _of_store(source / STORE)
        yield from _of_sessions(sorted(path.parent for path in source.glob(f"*/{MANIFEST}")), notes)
    elif source.is_file():
        yield from _of_store(source)
    else:
        raise InputError(
            Problem("is not there", Place(source), allowed="a session, a folder of sessions, or a store of results")
        )


def _of_sessions(folders: Iterable[Path], notes: list[str]) -> Iterator[Run]:
    unfinished = 0
    for folder in folders:
        session = open_session(folder)
        if not session.has_results:
            unfinished += 1
            continue
        try:
            yield run_of_results(session.read_results())
        except TypeError as error:
            raise InputError(Problem(f"is damaged: {error}", Place(folder / RESULTS))) from None
    if unfinished:
        notes.append(f"{unfinished} sessions have no results: replay them to have them counted")


def run_of_results(results: RunResult) -> Run:
    """Return a run of the history from the results of a run."""
    unit, bench = results.unit, results.bench
    measured = results.measurements.values()
    return _run(
        (results.run_id, results.started, bench.name, results.scenario),
        (unit.serial, unit.part_number, unit.revision),
        (bench.outcome, unit.verdict, unit.reason_id),
        {one.id: (one.value, one.low, one.high, one.limit_low, one.limit_high, one.unit) for one in measured},
    )


def _of_store(path: Path) -> Iterator[Run]:
    require_file(path)
    try:
        with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)) as store:
            numbers: dict[str, dict[str, _Row]] = {}
            for run_id, number, *row in store.execute(
                "SELECT run_id, id, value, low, high, limit_low, limit_high, unit FROM numbers"
            ):
                numbers.setdefault(run_id, {})[number] = (*row,)
            for row in store.execute(
                "SELECT run_id, started, bench, scenario, serial, part_number, revision, bench_outcome, verdict, reason"
                " FROM runs WHERE ended"
            ):
                reason = "" if row[9] is None else row[9]
                yield _run(row[:4], row[4:7], (*row[7:9], reason), numbers.get(row[0], {}))
    except (sqlite3.Error, TypeError) as error:
        raise InputError(
            Problem(f"is no store of results: {error}", Place(path), allowed=f"a {STORE} that runs have written")
        ) from None


def _run(
    run: tuple[str, str, str, str],
    unit: tuple[str, str, str],
    outcome: tuple[str, str | None, str],
    numbers: Mapping[str, _Row],
) -> Run:
    units = (row[-1] for row in numbers.values())
    texts = (*run, *unit, outcome[0], outcome[2], *numbers, *units, "" if outcome[1] is None else outcome[1])
    if not all(isinstance(text, str) for text in texts):
        raise TypeError("a name, a time or a verdict of a run is no text")
    values = [value for row in numbers.values() for value in row[:-1] if value is not None]
    if not all(isinstance(value, int | float) and abs(value) <= _LARGEST for value in values):  # nan, too
        raise TypeError("a number of a run is none")
    measured = {name: Measured(row[0], *row[1:]) for name, row in numbers.items() if row[0] is not None}
    temperature = measured.pop(TEMPERATURE, None)
    return Run(*run, *unit, *outcome, None if temperature is None else temperature.value, measured)
