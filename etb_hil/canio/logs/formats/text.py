"""Vector's ASC and candump's log, by scanners of our own."""

from __future__ import annotations

from pathlib import Path

from etb_hil.canio.logs.log_reader import LogReader, Reader


def _open(path: Path) -> LogReader:
    from etb_hil.canio.logs.text import TextLog  # noqa: PLC0415 (imported where a log is read)

    return TextLog(path)


READER = Reader("Vector's ASC and candump's log", (".asc", ".log"), _open, reads_gzip=True)
