"""Frames written to log files of any format that can be read."""

from __future__ import annotations

import sqlite3
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.canio.frames import FrameFlag
from etb_hil.canio.logs.blf import BlfLog

if TYPE_CHECKING:
    from etb_hil.canio.frames import FrameBlock

_BY_PYTHON_CAN = (".asc", ".log", ".trc", ".csv", ".db", ".asc.gz", ".log.gz", ".csv.gz", ".trc.gz")
_WRITABLE = (".blf", ".mf4", *_BY_PYTHON_CAN)
_NOT_HELD = {".trc": FrameFlag.FD | FrameFlag.ERROR | FrameFlag.REMOTE, ".csv": FrameFlag.FD, ".db": FrameFlag.FD}
_TABLE = (
    "CREATE TABLE messages (ts REAL, arbitration_id INTEGER, extended INTEGER, remote INTEGER, error INTEGER, "
    "dlc INTEGER, data BLOB)"
)


class LogWriter(Protocol):
    """A log file that grows; `left_out` counts the frames that its format cannot hold."""

    left_out: int

    def write(self, frames: FrameBlock) -> None:
        """Take frames in the order in which they were seen."""
        ...

    def close(self) -> None:
        """Complete the file."""
        ...


def log_suffix(path: Path) -> str:
    """Return the ending that names a log's format, with that of its compression."""
    inner = Path(path.stem).suffix if path.suffix.lower() == ".gz" else ""
    return (inner + path.suffix).lower()


def require_writable(path: Path) -> None:
    """Raise InputError where the suffix names no format that can be written."""
    if log_suffix(path) not in _WRITABLE:
        what = "must have a suffix of a log format"
        allowed = f"{', '.join(_WRITABLE)}, and .parquet for signals"
        raise InputError(Problem(what, Place(path), path.name, allowed=allowed))


def held(suffix: str, frames: FrameBlock) -> FrameBlock:
    """Return the frames that a format can hold."""
    never = _NOT_HELD.get(suffix.removesuffix(".gz"), FrameFlag(0))
    return frames.select((frames.flags & never) == 0) if never else frames


def write_log(path: Path, start_ns: int) -> LogWriter:
    """Open a log for writing, its format named by its suffix.

    `start_ns` is the earliest stamp.

    InputError where the format is unknown or the file cannot be written.
    """
    require_writable(path)
    suffix = log_suffix(path)
    if suffix == ".blf":
        if start_ns < 0:
            wrong = "its first stamp is before 1970, which the format does not hold"
            raise InputError(Problem(wrong, Place(path), remedy="export to .mf4"))
        return _BlfWriter(path, start_ns)
    if suffix == ".mf4":
        from etb_hil.canio.logs.mf4_writer import Mf4Log  # noqa: PLC0415 (few logs are)

        return Mf4Log(path, start_ns)
    return _SqliteWriter(path) if suffix == ".db" else _PythonCanWriter(path, suffix, start_ns)


class _BlfWriter:
    def __init__(self, path: Path, start_ns: int) -> None:
        self.left_out = 0
        self._log = BlfLog(path, start_ns)

    def write(self, frames: FrameBlock) -> None:
        self._log.write(frames)

    def close(self) -> None:
        self._log.close()


class _PythonCanWriter:
    def __init__(self, path: Path, suffix: str, start_ns: int) -> None:
        import can  # noqa: PLC0415 (importing can is slow)

        from etb_hil.canio.logs.asc_writer import AscLog  # noqa: PLC0415
        from etb_hil.canio.messages import to_message  # noqa: PLC0415

        self.left_out = 0
        self._suffix = suffix
        self._to_message = to_message
        try:
            is_asc = suffix.startswith(".asc")
            self._logger: Any = AscLog(path, start_ns) if is_asc else can.Logger(path)
        except OSError as error:
            wrong = f"cannot be written: {error.strerror or error}"
            raise InputError(Problem(wrong, Place(path), remedy="give another path")) from None

    def write(self, frames: FrameBlock) -> None:
        fit = held(self._suffix, frames)
        self.left_out += len(frames) - len(fit)
        for row in range(len(fit)):
            self._logger.on_message_received(self._to_message(fit, row))

    def close(self) -> None:
        self._logger.stop()


class _SqliteWriter:
    """python-can's table of frames.

    Its own writer loses what it still holds when it is stopped.
    """

    def __init__(self, path: Path) -> None:
        self.left_out = 0
        try:
            path.unlink(missing_ok=True)
            self._database = sqlite3.connect(path)
            self._database.execute(_TABLE)
        except (OSError, sqlite3.Error) as error:
            raise InputError(Problem(f"cannot be written: {error}", Place(path), remedy="give another path")) from None

    def write(self, frames: FrameBlock) -> None:
        count = len(frames)
        frames = held(".db", frames)
        self.left_out += count - len(frames)
        bits = [
            ((frames.flags & flag) != 0).tolist() for flag in (FrameFlag.EXTENDED, FrameFlag.REMOTE, FrameFlag.ERROR)
        ]
        lengths = frames.length.tolist()
        payloads = [row.tobytes()[:length] for row, length in zip(frames.data, lengths, strict=True)]
        seconds = (frames.stamp_ns / 1e9).tolist()
        rows = zip(seconds, frames.ident.tolist(), *bits, lengths, payloads, strict=True)
        self._database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?, ?, ?, ?)", rows)

    def close(self) -> None:
        self._database.commit()
        self._database.close()
