"""Log files of any format become columns of frames."""

from __future__ import annotations

from pathlib import Path

from etb_hil.canio.foreign_logs import ForeignLog


def read_log(path: Path) -> ForeignLog:
    """Open a log; iterated, it yields its frames as FrameBlocks, in order and in bounded memory.

    BLF, ASC, TRC, candump's `.log`, python-can's CSV and SQLite, MF4; text also as `.gz`. Stamps are as exact as the
    format holds them. Its `notes` say afterwards what could not be read. Raises InputError where the format is unknown
    or, while reading, where no frame can be read.
    """
    return ForeignLog(path)
