"""Read runs of the past from stores of results and folders of sessions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.results.run_result import RunResult
from etb_hil.session.session import MANIFEST, RESULTS, open_session
from etb_hil.store.address import STORE, StoreAddress
from etb_hil.store.queue import Queue
from etb_hil.store.run import Run, run_of
from etb_hil.store.selection import EVERYTHING, Selection

_UNFINISHED = "{} sessions have no results: replay them to have them counted"


def read_runs(sources: Iterable[Path | StoreAddress], selection: Selection = EVERYTHING) -> tuple[list[Run], list[str]]:
    """Return finished runs in order of time, and what was left out.

    They are read from stores, sessions and folders of sessions.

    A run that several sources hold counts once. Raises InputError where a source is none of these.
    """
    found: dict[tuple[str, str], Run] = {}
    notes: list[str] = []
    for source in sources:
        before = len(found)
        for run in _of_source(source, selection, notes):
            found.setdefault((run.run_id, run.started), run)
        if len(found) == before:
            notes.append(f"{source}: no finished run that was not read before")
    ordered = sorted(found.values(), key=lambda run: (run.started, run.run_id))
    if selection.latest is not None and len(ordered) >= selection.latest:
        notes.append(f"the latest {selection.latest} runs; there may be earlier ones")
        ordered = ordered[-selection.latest :]
    return ordered, notes


def runs_at(sessions: Path, store: StoreAddress, selection: Selection, notes: list[str] | None = None) -> list[Run]:
    """Return a bench's past runs: those of its store, and those that wait for it.

    Where a server does not answer, those of the bench's own sessions take the place of the store's. `notes` get what
    cannot be read.
    """
    unread: list[str] = [] if notes is None else notes
    runs: list[Run] = []
    if store.is_server or store.path.is_file():
        try:
            runs = _of_store(store, selection)
        except InputError:
            if not store.is_server:
                raise
            runs = [*_of_own_sessions(sessions, selection, unread)]
    known = {(run.run_id, run.started) for run in runs}
    waiting = (run for run in Queue(sessions).runs(unread) if selection.takes(run))
    runs += [run for run in waiting if (run.run_id, run.started) not in known]
    return sorted(runs, key=lambda run: (run.started, run.run_id))


def deciding_runs(sessions: Path, store: StoreAddress, selection: Selection) -> list[Run]:
    """Return a bench's past runs, as `runs_at` does, to decide by them.

    InputError where one cannot be read that may be among them: it may be the run that decides.
    """
    unread: list[str] = []
    runs = runs_at(sessions, store, selection, unread)
    if unread:
        what = "earlier runs cannot be read, so whether a unit may be tested is not known"
        raise InputError(Problem(what, Place(sessions)), *unread)
    return runs


def _of_source(source: Path | StoreAddress, selection: Selection, notes: list[str]) -> Iterable[Run]:
    if isinstance(source, StoreAddress) and source.is_server:
        return _of_store(source, selection)
    path = source.path if isinstance(source, StoreAddress) else source
    if path.is_file():
        return _of_store(StoreAddress(path), selection)
    if not path.is_dir():
        raise InputError(
            Problem(
                "no such file or folder", Place(path), allowed="a session, a folder of sessions, or a store of results"
            )
        )
    if (path / MANIFEST).is_file():
        named = _of_session(path)
        if named is None:
            notes.append(_UNFINISHED.format(1))
            return []
        return [named] if selection.takes(named) else []
    runs = [run for run in _of_sessions(_sessions(path), notes) if selection.takes(run)]
    stored = _of_store(StoreAddress(path / STORE), selection) if (path / STORE).is_file() else []
    return [*stored, *(run for run in Queue(path).runs(notes) if selection.takes(run)), *runs]


def _of_store(store: StoreAddress, selection: Selection) -> list[Run]:
    from etb_hil.store.reading import read_store  # noqa: PLC0415 (SQLAlchemy takes 0.1 s to load)

    return read_store(store, selection)


def _sessions(folder: Path) -> list[Path]:
    return sorted(path.parent for path in folder.glob(f"*/{MANIFEST}"))


def _of_sessions(folders: Iterable[Path], notes: list[str]) -> Iterator[Run]:
    unfinished = 0
    for folder in folders:
        try:
            run = _of_session(folder)
        except InputError as error:  # one of thousands
            notes.append(f"left out: {error}")
            continue
        if run is None:
            unfinished += 1
        else:
            yield run
    if unfinished:
        notes.append(_UNFINISHED.format(unfinished))


def _of_own_sessions(sessions: Path, selection: Selection, unread: list[str]) -> Iterator[Run]:
    """Yield the selected runs of a bench's own sessions.

    `unread` get what is wrong with a session that may be one of them: its manifest names a serial number, too.
    """
    for folder in _sessions(sessions):
        try:
            run = _of_session(folder)
        except InputError as error:
            if selection.serials is None or _serial_of(folder) in {*selection.serials, None}:
                unread.append(str(error))
            continue
        if run is not None and selection.takes(run):
            yield run


def _serial_of(folder: Path) -> str | None:
    try:
        return open_session(folder).serial
    except InputError:
        return None


def _of_session(folder: Path) -> Run | None:
    """Return the run of a session, None where it has no results.

    InputError where it is damaged.
    """
    session = open_session(folder)
    try:
        return run_of_results(session.read_results()) if session.has_results else None
    except TypeError as error:
        raise InputError(Problem(f"is damaged: {error}", Place(folder / RESULTS))) from None


def run_of_results(results: RunResult) -> Run:
    """Return a run of the history from the results of a run."""
    unit, bench = results.unit, results.bench
    measured = results.measurements.values()
    return run_of(
        (results.run_id, results.started, bench.name, results.scenario),
        (unit.serial, unit.part_number, unit.revision),
        (bench.outcome, unit.verdict, unit.reason_id),
        {one.id: (one.value, one.low, one.high, one.limit_low, one.limit_high, one.unit) for one in measured},
    )
