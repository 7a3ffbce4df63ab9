"""The frames in python-can's table of an SQLite file, and nothing else."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Self

import can

from etb_hil.base.userfile import open_file
from etb_hil.canio.logs.row_rules import WrongRowError, message_of

_COLUMNS = "ts, arbitration_id, extended, remote, error, dlc, data"
_LONGEST_VALUE = 4096  # bytes; a payload has 64
_LEAST_ROW = 10  # bytes of a row of seven columns: a file that gives more rows goes in circles
_HEADER = 100
_ALLOWED = (sqlite3.SQLITE_SELECT, sqlite3.SQLITE_READ)


class SqliteRows:
    """Messages of the table `messages`, in its order.

    A wrong row gives a WrongRowError in place of a message.

    A file that is damaged raises sqlite3.Error or ValueError.

    A file may define views and functions that never end, and values of any length: no such thing is asked for.
    """

    def __init__(self, path: Path) -> None:
        self._most_rows = _whole(path) // _LEAST_ROW
        self._database = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._database.close()

    def __iter__(self) -> Iterator[can.Message | WrongRowError]:
        self._database.text_factory = _text
        self._database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LONGEST_VALUE)
        self._database.set_authorizer(_authorize)
        root = self._database.execute("SELECT rootpage FROM sqlite_master WHERE name = 'messages'").fetchone()
        if root is not None and not root[0]:
            raise ValueError("messages is a view, no table")
        for count, row in enumerate(self._database.execute(f"SELECT {_COLUMNS} FROM messages")):  # noqa: S608 (ours)
            if count >= self._most_rows:
                raise ValueError("its pages go in circles")
            try:
                yield _message(row)
            except WrongRowError as error:
                yield error


def _authorize(action: int, *_: object) -> int:
    return sqlite3.SQLITE_OK if action in _ALLOWED else sqlite3.SQLITE_DENY


def _text(raw: bytes) -> str:
    """Return any text of a column; sqlite3 would stop at one that is not UTF-8."""
    return raw.decode("utf-8", "replace")


def _message(row: tuple[object, ...]) -> can.Message:
    seconds, ident, extended, remote, error, dlc, data = row
    if not isinstance(seconds, float | int) or not isinstance(ident, int) or not isinstance(dlc, int):
        raise WrongRowError("ts, arbitration_id and dlc must be numbers", (seconds, ident, dlc))
    if not isinstance(data, bytes | None):
        raise WrongRowError("a payload must be a BLOB", data)
    return message_of(seconds, ident, (extended, remote, error), dlc, data)


def _whole(path: Path) -> int:
    """Return the size of a file that is whole.

    Of one that is cut off, SQLite reads what is missing as zeros.
    """
    with open_file(path) as file:
        head = file.read(_HEADER)
        size = file.seek(0, 2)
    if head[:15] == b"SQLite format 3" and len(head) == _HEADER:
        page = int.from_bytes(head[16:18], "big")
        whole = int.from_bytes(head[28:32], "big") * (65536 if page == 1 else page)
        if size < whole:
            raise ValueError(f"{size} of {whole} bytes are there; `sqlite3 {path.name} .recover` finds the rest")
    return size
