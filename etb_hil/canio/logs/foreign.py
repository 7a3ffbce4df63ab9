"""Logs in the formats that python-can reads; a broken end costs what is broken, not what came before."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import closing, nullcontext
from dataclasses import dataclass, replace
from importlib import import_module
from io import StringIO
from pathlib import Path
from typing import Any

import can
from can.util import dlc2len

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.lean_imports import bring_asammdf_back
from etb_hil.canio.frames import FrameBlock
from etb_hil.canio.logs.line_source import LineSource, reader_warnings
from etb_hil.canio.messages import from_messages

CHUNK = 8192
MAX_CHANNEL = 255
MAX_IDENT = 0x1FFFFFFF
TABLES = "a table of signals is no log of frames: `etb-hil explain` and `etb-hil plot` read tables"
MAX_SECONDS = 9e9  # what int64 holds in nanoseconds
_INDEX = re.compile(r"[0-9]+\Z")


@dataclass(frozen=True, slots=True)
class _Format:
    """A format that python-can reads; `step_ns` is the finest step of its stamps."""

    name: str
    reader: Callable[..., Any]
    step_ns: int
    text: bool = True
    ends_lines: bool = False  # its writers end every line, so that a last line without an end was cut off
    fd_codes: bool = False  # python-can gives the code 0 to 15 as `dlc` of its FD frames, not the bytes
    remedy: str = "check that the file is what its name says"
    first_channel: int = 0  # PEAK's buses count from 1, and python-can's reader, not its writer, keeps their number


def _mf4_reader(path: Path) -> Any:  # noqa: ANN401 (python-can's readers share no type)
    bring_asammdf_back()
    return import_module("can.io.mf4").MF4Reader(path)


def _sqlite_reader(path: Path) -> Any:  # noqa: ANN401 (likewise)
    """Open a database that is whole: of one that is cut off, SQLite reads what is missing of a page as zeros."""
    with path.open("rb") as file:
        head = file.read(100)
    if head[:15] == b"SQLite format 3" and len(head) == 100:
        page = int.from_bytes(head[16:18], "big")
        whole = int.from_bytes(head[28:32], "big") * (65536 if page == 1 else page)
        size = path.stat().st_size
        if size < whole:
            raise ValueError(f"{size} of {whole} bytes are there; `sqlite3 {path.name} .recover` finds what is left")
    return can.SqliteReader(path)


_CSV_COLUMNS = "its columns are timestamp, arbitration_id, extended, remote, error, dlc, data"

# python-can's stamps are floats. Those of TRC and candump count whole microseconds, which a float of today's epoch
# still tells apart (its own step is 0.24 us): rounding to the step undoes every error. ASC counts from zero, so that a
# nanosecond survives. CSV, SQLite and MF4 hold the float itself.
FORMATS = {
    ".asc": _Format("ASC", can.ASCReader, 1),
    ".trc": _Format("TRC", can.TRCReader, 1000, fd_codes=True, first_channel=1),
    ".log": _Format("candump", can.CanutilsLogReader, 1000, ends_lines=True),
    ".csv": _Format("python-can CSV", can.CSVReader, 1, ends_lines=True, remedy=f"{_CSV_COLUMNS}; {TABLES}"),
    ".db": _Format("python-can SQLite", _sqlite_reader, 1, text=False),
    ".mf4": _Format("MF4", _mf4_reader, 1, text=False),
}


class ForeignLog:
    """A log file, read anew by each iteration; afterwards `notes` says what could not be read, and where."""

    def __init__(self, path: Path) -> None:
        suffix = Path(path.stem).suffix if path.suffix.lower() == ".gz" else path.suffix
        known = FORMATS.get(suffix.lower())
        if known is None:
            allowed = f".blf, {', '.join(FORMATS)}, each also with .gz"
            what = "is no log format that can be read"
            raise InputError(Problem(what, Place(path), path.name, allowed=allowed, remedy=TABLES))
        self.path = path
        self.notes: list[str] = []
        self.begin_ns: int | None = 0
        self._format = known

    def __iter__(self) -> Iterator[FrameBlock]:
        """Yield the frames in blocks; InputError where not even the first frame can be read."""
        self.notes = []
        frames = 0
        fault: Exception | None = None
        lines = self._lines()
        with closing(lines) if lines else nullcontext(), reader_warnings() as warnings:
            messages = self._messages(lines or self.path)
            more = True
            while more:
                chunk, fault = _take(messages)
                if chunk:
                    frames += len(chunk)
                    yield _block(chunk, self._format)
                more = len(chunk) == CHUNK and fault is None
            self.notes += [f"{self.path}: {text}" for text in warnings]
        line = lines.line if lines else None
        if fault is not None:
            self._stopped(fault, frames, line)
        elif lines and lines.is_cut():
            self.notes.append(f"{Place(self.path, line)}: the last line is cut off and was left out")

    def _lines(self) -> LineSource | None:
        try:
            if self._format.text:
                return LineSource(self.path, ends_lines=self._format.ends_lines)
            self.path.open("rb").close()  # here, where the error is of one kind, whichever library reads it
        except OSError as error:
            wrong = f"cannot be read: {error.strerror or error}"
            raise InputError(Problem(wrong, Place(self.path), remedy="check the path and its permissions")) from None
        return None

    def _messages(self, source: LineSource | Path) -> Iterator[can.Message]:
        with self._format.reader(source) as reader:
            for message in reader:
                if isinstance(source, LineSource):
                    source.frame_line = source.line
                yield _checked(message, self._format)

    def _stopped(self, fault: Exception, frames: int, line: int | None) -> None:
        place = Place(self.path, line, frame=frames)
        what = f"is not readable as {self._format.name} from here: {fault or type(fault).__name__}"
        if not frames:
            raise InputError(Problem(what, place, remedy=self._format.remedy)) from None
        self.notes.append(f"{place}: {what}; the {frames} frames before are kept")


def frames_of_text(text: str, suffix: str) -> tuple[FrameBlock, list[str], str]:
    """Return the frames in lines of a format of text, what python-can warned of, and why it stopped, if it did."""
    known = FORMATS[suffix]
    with reader_warnings() as warnings, known.reader(StringIO(text, newline=None)) as reader:
        messages, fault = _take(_checked(message, known) for message in reader)
    return _block(messages, known), warnings, str(fault) or type(fault).__name__ if fault else ""


def _checked(message: can.Message, known: _Format) -> can.Message:
    """Return a message with its channel as a number; refuse one that is not whole or that no bus can carry.

    python-can's readers let such lines through.
    """
    length = len(message.data)
    if not _announced(message, known) <= length <= (64 if message.is_fd else 8) or message.dlc > 64:
        raise ValueError(f"{length} bytes of {message.dlc}")
    if not 0 <= message.arbitration_id <= MAX_IDENT:
        raise ValueError(f"no identifier: {message.arbitration_id:x}")
    if not abs(message.timestamp) < MAX_SECONDS:  # nan, too
        raise ValueError(f"no time: {message.timestamp}")
    index = _INDEX.search(str(message.channel))  # vcan1 is channel 1
    message.channel = min(max(int(index[0]) - known.first_channel, 0), MAX_CHANNEL) if index else 0
    return message


def _announced(message: can.Message, known: _Format) -> int:
    """Return how many bytes the frame must have."""
    if message.is_remote_frame or message.is_error_frame:
        return 0
    if message.is_fd:
        return dlc2len(message.dlc) if known.fd_codes else message.dlc
    return min(message.dlc, 8)  # classic frames may say 9 to 15 and mean 8


def _block(messages: list[can.Message], known: _Format) -> FrameBlock:
    block = from_messages(messages)
    step = known.step_ns
    return replace(block, stamp_ns=(block.stamp_ns + step // 2) // step * step)


def _take(messages: Iterator[can.Message]) -> tuple[list[can.Message], Exception | None]:
    """Return the next messages and what stopped the reader, if anything did."""
    chunk: list[can.Message] = []
    try:
        for message in messages:
            chunk.append(message)
            if len(chunk) == CHUNK:
                break
    except Exception as error:  # noqa: BLE001 (readers of eight formats raise what their parsers raise)
        return chunk, error
    return chunk, None
