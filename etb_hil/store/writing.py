"""A run's rows into a store: all of them or none, and those of one run only once."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import nullcontext
from typing import TYPE_CHECKING, Any

from etb_hil.store.connection import begin, mark
from etb_hil.store.row_values import CHILDREN

if TYPE_CHECKING:
    from etb_hil.store.address import StoreAddress
    from etb_hil.store.row_values import Row, RunRows

Content = Callable[["Row"], bytes | None]


def write_run(address: StoreAddress, connection: Any, rows: RunRows, content: Content) -> bool:  # noqa: ANN401
    """Write a run in one transaction; return False where the store has it already.

    `content(row)` returns what is in a file of the run, or None where it is gone; a file that the store has is not
    asked for.
    """
    begin(address, connection)
    try:
        added = _write(address, connection, rows, content)
        connection.commit()
    except BaseException:
        connection.rollback()
        raise
    return added


def _write(address: StoreAddress, connection: Any, rows: RunRows, content: Content) -> bool:  # noqa: ANN401
    (run,) = rows["runs"]
    place, cursor = mark(address), connection.cursor()
    cursor.execute(f"{_insert('runs', run, place)} ON CONFLICT DO NOTHING RETURNING id", [*run.values()])
    entered = cursor.fetchall()
    if not entered:
        return False
    for file in sorted(rows["run_files"], key=lambda row: str(row["sha256"])):
        digest = file["sha256"]
        cursor.execute(f"SELECT 1 FROM files WHERE sha256 = {place} AND content IS NOT NULL", [digest])  # noqa: S608
        if cursor.fetchone() is None:
            found = content(file)
            if found is not None and hashlib.sha256(found).hexdigest() != digest:
                found = None  # changed since the run: not the file that it was made with
            upsert = "ON CONFLICT (sha256) DO UPDATE SET content = coalesce(files.content, excluded.content)"
            one = {"sha256": digest, "content": found}
            cursor.execute(f"{_insert('files', one, place)} {upsert}", [*one.values()])
    with connection.pipeline() if address.is_server else nullcontext():  # a server is waited for once
        for table in CHILDREN:
            if rows[table]:
                complete = [{"run": entered[0][0], **row} for row in rows[table]]
                cursor.executemany(_insert(table, complete[0], place), [[*row.values()] for row in complete])
    return True


def _insert(table: str, row: Row, place: str) -> str:
    """Return the statement that inserts a row.

    Tables and columns are those of `row_values`, no text from outside.
    """
    return f"INSERT INTO {table} ({', '.join(row)}) VALUES ({', '.join([place] * len(row))})"  # noqa: S608
