"""python-can's SQLite database."""

from __future__ import annotations

from pathlib import Path

from etb_hil.canio.logs.log_reader import LogReader, Reader


def _open(path: Path) -> LogReader:
    from etb_hil.canio.logs.foreign import ForeignLog  # noqa: PLC0415 (importing can is slow)

    return ForeignLog(path)


READER = Reader("python-can's SQLite database", (".db",), _open)
