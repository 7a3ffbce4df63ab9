"""Runs of the past: read from a store of results, from folders of sessions, or from both."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.session.session import MANIFEST, RESULTS, open_session
from etb_hil.session.store import STORE

TEMPERATURE = "temperature"
_Row = tuple[float | None, ...]
_UNDECIDED = "_undecided"  # a sound measurement, too close to its limit for a verdict


@dataclass(frozen=True, slots=True)
class Measured:
    """A number of a run in SI units, with its 95 % interval and its limits; None where there is none."""

    value: float
    low: float | None
    high: float | None
    limit_low: float | None
    limit_high: float | None


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
        results = session.read_results()
        try:
            yield run_of_results(results)
        except (KeyError, TypeError) as error:
            raise InputError(Problem(f"is damaged: {error}", Place(folder / RESULTS))) from None
    if unfinished:
        notes.append(f"{unfinished} sessions have no results: replay them to have them counted")


def run_of_results(results: Mapping[str, Any]) -> Run:
    """Return a run from the contents of its `results.json`; KeyError or TypeError where they are none."""
    unit, bench = results["unit"], results["bench"]
    return _run(
        (results["run_id"], results["started"], bench["name"], results.get("scenario", "")),
        (unit["serial"], unit["part_number"], unit["revision"]),
        (bench["outcome"], unit["verdict"], unit["reason_id"]),
        {n["id"]: (n["value"], n["low"], n["high"], n["limit_low"], n["limit_high"]) for n in results["numbers"]},
    )


def _of_store(path: Path) -> Iterator[Run]:
    try:
        with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)) as store:
            numbers: dict[str, dict[str, _Row]] = {}
            for run_id, number, *row in store.execute(
                "SELECT run_id, id, value, low, high, limit_low, limit_high FROM numbers"
            ):
                numbers.setdefault(run_id, {})[number] = tuple(row)
            for row in store.execute(
                "SELECT run_id, started, bench, scenario, serial, part_number, revision, bench_outcome, verdict, reason"
                " FROM runs WHERE ended"
            ):
                reason = "" if row[9] is None else row[9]
                yield _run(row[:4], row[4:7], (*row[7:9], reason), numbers.get(row[0], {}))
    except sqlite3.Error as error:
        raise InputError(
            Problem(f"is no store of results: {error}", Place(path), allowed=f"a {STORE} that runs have written")
        ) from None


def _run(
    run: tuple[str, str, str, str],
    unit: tuple[str, str, str],
    outcome: tuple[str, str | None, str],
    numbers: Mapping[str, _Row],
) -> Run:
    measured = {name: Measured(row[0], *row[1:]) for name, row in numbers.items() if row[0] is not None}
    temperature = measured.pop(TEMPERATURE, None)
    return Run(*run, *unit, *outcome, None if temperature is None else temperature.value, measured)
