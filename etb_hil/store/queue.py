"""Runs that wait for the store, a file each beside the sessions.

A file is there from the end of its run until the store has it.

So a store that is down costs no verdict, and no bench waits for it before its verdict is said.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.files import make_folder, write_text
from etb_hil.base.userfile import read_bytes, unreadable
from etb_hil.store.address import QUEUE
from etb_hil.store.connection import up_to_date
from etb_hil.store.row_values import CHILDREN, rows_of
from etb_hil.store.run import Run, waiting_run
from etb_hil.store.writing import write_run

if TYPE_CHECKING:
    from etb_hil.results.run_result import RunResult
    from etb_hil.store.address import StoreAddress
    from etb_hil.store.row_values import Row

SCHEMA = "etb_hil/waiting_run/1"
_REFUSALS = (ValueError, TypeError, KeyError, OverflowError, RecursionError)


@dataclass(frozen=True, slots=True)
class Delivered:
    """How many runs arrived and how many wait still.

    `warnings` say why, a sentence each.
    """

    arrived: int = 0
    waiting: int = 0
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Queue:
    """The runs of a folder of sessions that wait for the store."""

    sessions: Path

    @property
    def folder(self) -> Path:
        """The folder with a file for each run that waits."""
        return self.sessions / QUEUE

    def add(self, results: RunResult, session: Path, run_id: str = "") -> None:
        """Have a run wait; `session` is the folder with its inputs.

        InputError where the disk is full or gone.
        """
        waiting = {"schema": SCHEMA, "session": session.name, "rows": rows_of(results, run_id)}
        path = make_folder(self.folder) / f"{run_id or results.run_id}.json"
        write_text(path, json.dumps(waiting, ensure_ascii=False) + "\n")

    def paths(self) -> list[Path]:
        """Return the files of the runs that wait, the oldest first."""
        return sorted(path for path in self.folder.glob("*.json") if not path.name.startswith("."))  # half a file

    def runs(self, notes: list[str]) -> Iterator[Run]:
        """Yield the runs that wait.

        One that just arrived is left out. One that cannot be read is left out, too, and `notes` get why.
        """
        try:
            paths = self.paths() if any(self.folder.iterdir()) else []
        except FileNotFoundError:  # nothing ever waited here
            return
        except OSError as error:
            notes.append(str(unreadable(self.folder, error)))
            return
        for path in paths:
            try:
                run = waiting_run(_read(path)["rows"])
            except (InputError, *_REFUSALS) as error:
                if path.exists():
                    notes.append(str(_unreadable(path, error)))
            else:
                yield run

    def deliver(self, address: StoreAddress) -> Delivered:
        """Write the runs that wait into the store, each once, and let them go.

        What fails stays for the next time.

        A run that the store refuses is named and does not keep the others. Never raises for what is wrong with store
        or disk: `warnings` tell it.
        """
        paths = self.paths()
        if not paths:
            return Delivered()
        arrived, warnings = 0, []
        try:
            with up_to_date(address) as connection:
                for path in paths:
                    try:
                        arrived += self._deliver(address, connection, path)
                    except InputError as error:
                        warnings.append(str(error))
        except (OSError, InputError) as error:
            warnings.append(f"the store of results cannot be written: {error}")
        left = len(self.paths())
        if left and warnings:
            warnings.append(f"runs that wait in {self.folder}: {left}; they are tried again after the next run")
        return Delivered(arrived, left, tuple(warnings))

    def _deliver(self, address: StoreAddress, connection: Any, path: Path) -> bool:  # noqa: ANN401
        if not path.exists():  # another bench of this folder was faster
            return False
        try:
            waiting = _read(path)
            inputs = self.sessions / waiting["session"] / "inputs"
            added = write_run(address, connection, waiting["rows"], lambda row: _content(inputs, row))
        except _REFUSALS as error:
            if not path.exists():
                return False
            raise _unreadable(path, error) from None
        except Exception as error:
            if _is_of_this_run(error):
                raise InputError(Problem(f"the store refuses this run: {error}", Place(path))) from None
            raise
        path.unlink(missing_ok=True)
        return added


def _unreadable(path: Path, error: Exception) -> InputError:
    if isinstance(error, InputError):
        return error
    what = f"must hold a run that waits for the store: {type(error).__name__} {error}"
    remedy = "restore it; once you know the verdict of its session by 'etb-hil replay', you may move it away"
    return InputError(Problem(what, Place(path), remedy=remedy))


def _is_of_this_run(error: Exception) -> bool:
    """Return whether a driver's error lies in the values.

    Both drivers name their classes as PEP 249 does.
    """
    return bool({"DataError", "IntegrityError"} & {kind.__name__ for kind in type(error).__mro__})


def _content(inputs: Path, row: Row) -> bytes | None:
    name = Path(str(row["name"])).name
    with suppress(InputError):
        return read_bytes(inputs / name)
    return None


def _read(path: Path) -> dict[str, Any]:
    waiting: dict[str, Any] = json.loads(read_bytes(path))
    if waiting["schema"] != SCHEMA:
        raise ValueError(f"its schema is {waiting['schema']!r}, not {SCHEMA}")
    if Path(waiting["session"]).name != waiting["session"]:
        raise ValueError("its session lies in another folder")
    if len(waiting["rows"]["runs"]) != 1 or not all(isinstance(waiting["rows"][table], list) for table in CHILDREN):
        raise ValueError("its rows are incomplete")
    if not all(column.isidentifier() for table in waiting["rows"].values() for row in table for column in row):
        raise ValueError("a column has no name")  # names go into statements as they are
    return waiting
