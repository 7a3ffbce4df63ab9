"""The store of results: one SQLite file beside the sessions, into which several benches may write at once.

Each finished phase is in it before the next one is long under way, whatever happens to the run afterwards. The schema
is described in `docs/store.md`. Writing has a thread of its own: a disk that is slow must not delay a set-point.
"""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from etb_hil.base.errors import InputError, Place, Problem

if TYPE_CHECKING:
    from etb_hil.diagnosis.limits import Limits
    from etb_hil.results.run_result import RunResult
    from etb_hil.session.analysis import Analysis
    from etb_hil.session.events import EventSink
    from etb_hil.session.session import Session

STORE = "results.db"
VERSION = 1
PATIENCE_S = 30.0  # how long a writer waits for the others

_SCHEMA = """
CREATE TABLE IF NOT EXISTS runs (
    run_id TEXT PRIMARY KEY, bench TEXT NOT NULL, scenario TEXT NOT NULL, serial TEXT NOT NULL,
    part_number TEXT NOT NULL, revision TEXT NOT NULL, started TEXT NOT NULL,
    ended INTEGER NOT NULL DEFAULT 0, bench_outcome TEXT, bench_reason TEXT,
    verdict TEXT, reason TEXT, exit_code INTEGER, duration_s REAL
) STRICT;
CREATE TABLE IF NOT EXISTS phases (
    run_id TEXT NOT NULL REFERENCES runs, number INTEGER NOT NULL, phase_id TEXT NOT NULL, kind TEXT NOT NULL,
    start_ns INTEGER NOT NULL, end_ns INTEGER NOT NULL, so_far TEXT NOT NULL CHECK (json_valid(so_far)),
    PRIMARY KEY (run_id, number)
) STRICT, WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS numbers (
    run_id TEXT NOT NULL REFERENCES runs, id TEXT NOT NULL, value REAL, unit TEXT NOT NULL, low REAL, high REAL,
    limit_low REAL, limit_high REAL, verdict TEXT,
    PRIMARY KEY (run_id, id)
) STRICT, WITHOUT ROWID;
"""

_Write = Callable[[sqlite3.Connection], object]


def open_store(path: Path) -> sqlite3.Connection:
    """Open a store, or make one; InputError where the file is none, or was written by a later version."""
    connection = None
    try:
        connection = sqlite3.connect(path, timeout=PATIENCE_S, isolation_level=None, check_same_thread=False)
        connection.execute("PRAGMA journal_mode = WAL")
        # In WAL a commit outlives a killed process so; a flush to the disk while the plate moves would stall the host.
        connection.execute("PRAGMA synchronous = NORMAL")
        connection.execute("PRAGMA foreign_keys = ON")
        version = int(connection.execute("PRAGMA user_version").fetchone()[0])
        if version == 0:
            connection.executescript(f"BEGIN IMMEDIATE; {_SCHEMA} PRAGMA user_version = {VERSION}; COMMIT;")
            version = VERSION
    except sqlite3.Error as error:
        if connection is not None:
            connection.close()
        raise InputError(
            Problem(f"cannot serve as the store of results: {error}", Place(path), remedy="move the file away")
        ) from None
    if version != VERSION:
        connection.close()
        raise InputError(Problem("the store has another version", Place(path), version, str(VERSION), "move it away"))
    return connection


class RunInStore:
    """One run's rows: entered when it starts, a phase at a time, and its verdict at the end."""

    def __init__(self, path: Path, session: Session, bench: str, scenario: str, limits: Limits) -> None:
        self._path = path
        self._run_id = session.run_id
        self._first = (
            session.run_id, bench, scenario, session.serial, limits.part_number, limits.revision,
            session.started,
        )  # fmt: skip
        self._queue: SimpleQueue[_Write | None] = SimpleQueue()
        self._failure: sqlite3.Error | None = None
        self._thread = Thread(target=self._work, name="store of results", daemon=True)

    def __enter__(self) -> Self:
        self._connection = open_store(self._path)
        columns = "run_id, bench, scenario, serial, part_number, revision, started"
        self._queue.put(lambda c: c.execute(f"INSERT INTO runs ({columns}) VALUES (?, ?, ?, ?, ?, ?, ?)", self._first))  # noqa: S608 (our own words)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._queue.put(None)
        self._thread.join()
        self._connection.close()

    @property
    def warning(self) -> str:
        """What the store lacks of the run, once it was left; empty where it has all of it."""
        lacks = f"{self._path}: the store of results could not be written and lacks this run: {self._failure}"
        return f"{lacks}; the session holds everything" if self._failure is not None else ""

    def watching(self, events: EventSink, analysis: Analysis) -> EventSink:
        """Return a sink that passes events on, and puts each finished phase into the store."""
        return _PhaseWatch(events, analysis, self)

    def phase(self, number: int, phase_id: str, kind: str, start_ns: int, end_ns: int, so_far: dict[str, Any]) -> None:
        """Put a finished phase into the store: its place in the run, its times, and what was known when it ended."""
        row = (self._run_id, number, phase_id, kind, start_ns, end_ns, json.dumps(_plain(so_far)))
        self._queue.put(lambda c: c.execute("INSERT INTO phases VALUES (?, ?, ?, ?, ?, ?, ?)", row))

    def finish(self, results: RunResult) -> None:
        """Put the results into the store."""
        self._queue.put(lambda c: _write_results(c, self._run_id, results))

    def _work(self) -> None:
        """Write as it comes; once the store refuses, all that is left is written at the end, or not at all."""
        left: list[_Write] = []
        while (write := self._queue.get()) is not None:
            left.append(write)
            if self._failure is None:
                self._write(left)
        self._write(left)

    def _write(self, left: list[_Write]) -> None:
        self._failure = None
        try:
            while left:
                left[0](self._connection)
                del left[0]
        except sqlite3.Error as error:
            self._failure = error
            if self._connection.in_transaction:
                self._connection.rollback()


class _PhaseWatch:
    def __init__(self, events: EventSink, analysis: Analysis, run: RunInStore) -> None:
        self._events, self._analysis, self._run = events, analysis, run
        self._begun: tuple[str, str, int] = ("", "", 0)
        self._number = 0

    def add(self, stamp_ns: int, event: str, **details: object) -> None:
        """Write one event."""
        self._events.add(stamp_ns, event, **details)
        if event == "phase":
            self._begun = (str(details["id"]), str(details["kind"]), stamp_ns)
        elif event == "phase_end":
            snapshot = asdict(self._analysis.snapshot())
            snapshot["frames_lost"] = self._analysis.frames_lost
            self._run.phase(self._number, *self._begun, stamp_ns, snapshot)
            self._number += 1


def _plain(value: Any) -> Any:  # noqa: ANN401 (whatever JSON holds)
    """Return a value without numbers that JSON does not know."""
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _write_results(connection: sqlite3.Connection, run_id: str, results: RunResult) -> None:
    unit, bench = results.unit, results.bench
    rows = [
        (run_id, one.id, one.value, one.unit, one.low, one.high, one.limit_low, one.limit_high, one.verdict)
        for one in results.measurements.values()
    ]
    with closing(connection.cursor()) as cursor:
        cursor.execute("BEGIN IMMEDIATE")
        cursor.execute(
            "UPDATE runs SET ended = 1, bench_outcome = ?, bench_reason = ?, verdict = ?, reason = ?, exit_code = ?, "
            "duration_s = ? WHERE run_id = ?",
            (
                bench.outcome, bench.reason_id, unit.verdict, unit.reason_id, results.exit_code, results.duration_s,
                run_id,
            ),
        )  # fmt: skip
        cursor.executemany("INSERT INTO numbers VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", rows)
        cursor.execute("COMMIT")
