"""Vector's binary log."""

from __future__ import annotations

from pathlib import Path

from etb_hil.canio.logs.log_reader import LogReader, Reader


def _open(path: Path) -> LogReader:
    from etb_hil.canio.logs.blf import read_blf  # noqa: PLC0415 (imported where a log is read)

    return read_blf(path)


READER = Reader("Vector's binary log", (".blf",), _open)
