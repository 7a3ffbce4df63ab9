"""Maintenance of a whole store.

Say what it holds, copy it into another, delete what need not be kept.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import sqlalchemy as sa

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.store.address import StoreAddress
from etb_hil.store.connection import StoreDown, connected, require_schema
from etb_hil.store.reading import chosen_runs, joined_runs, opened, reading
from etb_hil.store.row_values import CHILDREN, RunRows
from etb_hil.store.schema import files, metadata, run_files, runs
from etb_hil.store.selection import Selection
from etb_hil.store.writing import write_run

if TYPE_CHECKING:
    from etb_hil.store.row_values import Row

_AT_ONCE = 500  # runs of one transaction: no bench waits for longer than these take


@dataclass(frozen=True, slots=True)
class Summary:
    """How many finished runs of how many units, parts and benches.

    `first` and `last` are when such runs began (ISO 8601, UTC).
    """

    runs: int
    units: int
    parts: int
    benches: int
    first: str | None
    last: str | None


def summary(address: StoreAddress, selection: Selection) -> Summary:
    """Return what a store holds of the selected runs.

    InputError where it is missing or does not answer.
    """
    chosen = joined_runs(selection)
    distinct = (sa.func.count(sa.distinct(chosen.c[name])) for name in ("serial", "part_number", "bench"))
    columns: list[Any] = [sa.func.count(), *distinct, sa.func.min(chosen.c.started), sa.func.max(chosen.c.started)]
    with reading(address) as connection:
        return Summary(*connection.execute(sa.select(*columns).select_from(chosen)).one())


def delete_runs(address: StoreAddress, selection: Selection) -> int:
    """Delete the selected runs for good; return how many went.

    Input files that no run has any longer go, too.

    Errors as `summary`. The file of an embedded store becomes smaller by it.
    """
    some = chosen_runs(selection).limit(_AT_ONCE).subquery()
    gone = 0
    with opened(address, writes=True) as engine:
        while True:
            with engine.begin() as connection:
                ids = connection.scalars(sa.select(some.c.id)).all()
                connection.execute(sa.delete(runs).where(runs.c.id.in_(ids)))
            gone += len(ids)
            if len(ids) < _AT_ONCE:
                break
        with engine.begin() as connection:
            connection.execute(sa.delete(files).where(files.c.sha256.not_in(sa.select(run_files.c.sha256))))
    if gone and not address.is_server:
        # A bench that writes now, or a disk without room for a copy, leaves the file as long as it was.
        with suppress(sqlite3.Error), closing(sqlite3.connect(address.path, isolation_level=None)) as file:
            file.execute("VACUUM")
    return gone


def copy_runs(source: StoreAddress, target: StoreAddress, selection: Selection) -> tuple[int, int]:
    """Copy the selected runs with all that belongs to them.

    Return how many were new there, and how many were known.

    Raises InputError where one of the stores is missing or does not answer, or the target fails on the way: what it has
    by then, it keeps, and a further copy adds the rest.
    """
    new = known = 0
    try:
        require_schema(target)
        with reading(source) as connection, connected(target, patient=True) as there:
            ids = connection.scalars(sa.select(joined_runs(selection).c.id)).all()
            for first in range(0, len(ids), _AT_ONCE):
                for rows in _rows_of(connection, ids[first : first + _AT_ONCE]):
                    added = write_run(target, there, rows, lambda file: _content(connection, file))
                    new, known = new + added, known + (not added)
    except StoreDown as error:
        what = f"runs cannot be copied: {error}"
        raise InputError(Problem(what, Place(str(target)), remedy="copy again; what was copied stays")) from None
    return new, known


def _rows_of(connection: sa.Connection, ids: Sequence[int]) -> Iterator[RunRows]:
    """Yield some runs' rows by table, without the keys that each store has of its own."""
    found: dict[int, RunRows] = {}
    for row in connection.execute(sa.select(runs).where(runs.c.id.in_(ids))).mappings():
        one: RunRows = {"runs": [{name: value for name, value in row.items() if name != "id"}]}
        found[row["id"]] = one | {table: [] for table in CHILDREN}
    for table in CHILDREN:
        of_table = metadata.tables[table]
        for row in connection.execute(sa.select(of_table).where(of_table.c.run.in_(ids))).mappings():
            found[row["run"]][table].append({name: value for name, value in row.items() if name != "run"})
    yield from found.values()


def _content(connection: sa.Connection, file: Row) -> bytes | None:
    content = connection.scalar(sa.select(files.c.content).where(files.c.sha256 == file["sha256"]))
    return None if content is None else bytes(content)
