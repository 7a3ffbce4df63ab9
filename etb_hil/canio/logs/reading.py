"""Log files of any format become columns of frames."""

from __future__ import annotations

from pathlib import Path

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.canio.logs.blf import read_blf
from etb_hil.canio.logs.log_reader import LogReader

_BINARY = {".blf", ".mf4", ".db"}


def read_log(path: Path) -> LogReader:
    """Open a log by its suffix; iterated, it yields its frames as FrameBlocks in bounded memory.

    BLF, ASC, TRC, candump's `.log`, python-can's CSV and SQLite, MF4; each also as `.gz`. Stamps are as exact as the
    format holds them. A broken end costs what is broken, not what came before. Raises InputError where the format is
    unknown.
    """
    if path.is_dir():
        what = "is a folder without a session.json: no session"
        raise InputError(Problem(what, Place(path), remedy="name a session's folder, or a log"))
    suffix = path.suffix.lower()
    if suffix == ".gz":
        suffix = Path(path.stem).suffix.lower()
        if suffix in _BINARY:
            from etb_hil.canio.logs.unpacked import UnpackedLog  # noqa: PLC0415 (few logs are)

            return UnpackedLog(path, read_log)
    if suffix == ".blf":
        return read_blf(path)
    if suffix in {".asc", ".log"}:
        from etb_hil.canio.logs.text import TextLog  # noqa: PLC0415 (nor numba for a raw log)

        return TextLog(path, suffix)
    if suffix == ".mf4":
        from etb_hil.canio.logs.mf4 import Mf4Reader  # noqa: PLC0415 (few logs are)

        return Mf4Reader(path)
    from etb_hil.canio.logs.foreign import ForeignLog  # noqa: PLC0415 (importing can is slow)

    return ForeignLog(path)
