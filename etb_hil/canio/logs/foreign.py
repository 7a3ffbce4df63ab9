"""Logs in the formats that python-can reads.

A broken end costs what is broken, not what came before; a wrong row costs itself alone.
"""

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

from etb_hil.base.errors import InputError, Place, Problem, shortened
from etb_hil.base.lean_imports import bring_asammdf_back
from etb_hil.base.userfile import require_file
from etb_hil.canio.frames import FrameBlock
from etb_hil.canio.logs.channels import FAR, Channels, too_far
from etb_hil.canio.logs.line_source import LineSource, reader_warnings
from etb_hil.canio.logs.log_reader import TABLES
from etb_hil.canio.logs.notes import Notes
from etb_hil.canio.logs.row_rules import WrongRowError
from etb_hil.canio.logs.sqlite_rows import SqliteRows
from etb_hil.canio.logs.text_rows import COLUMNS, CsvRows, TrcRows
from etb_hil.canio.messages import from_messages

CHUNK = 8192
MAX_IDENT, MAX_STANDARD = 0x1FFFFFFF, 0x7FF
Note = Callable[[str, str], None]  # takes what could not be read, and of what kind that is
MAX_SECONDS = 9e9  # what int64 holds in nanoseconds


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
    others: str = r"\s*$"  # lines that hold no frame, and are not meant to
    is_scanned: bool = False  # by `text`, which has rules of its own; python-can reads its unusual lines alone
    first_channel: int = 0  # what the file's channels count from: 1 for Vector and PEAK
    subtracted: int = 0  # what python-can's reader takes from their number: PEAK's it keeps


def _mf4_reader(path: Path) -> Any:  # noqa: ANN401 (python-can's readers share no type)
    bring_asammdf_back()
    return import_module("can.io.mf4").MF4Reader(path)


# Comments, what PEAK's tools say of the bus, and the events, error counters and states of version 2.
_TRC_OTHERS = r"\s*(;|$|\d+\)\s+\S+\s+(\d+\s+)?(FFFFFFFF|Warng)\b|\d+\s+\S+\s+(ST|EC|EV)\b)"
_CSV_COLUMNS = f"its columns are {COLUMNS.replace(',', ', ')}"

# python-can's stamps are floats. Those of TRC and candump count whole microseconds, which a float of today's epoch
# still distinguishes (its own step is 0.24 us): rounding to the step undoes every error. ASC counts from zero, so
# that a nanosecond survives. CSV, SQLite and MF4 hold the float itself.
FORMATS = {
    ".asc": _Format("ASC", can.ASCReader, 1, is_scanned=True, first_channel=1, subtracted=1),
    ".trc": _Format("TRC", TrcRows, 1000, fd_codes=True, others=_TRC_OTHERS, first_channel=1),
    ".log": _Format("candump", can.CanutilsLogReader, 1000, ends_lines=True, is_scanned=True),
    ".csv": _Format(
        "python-can CSV", CsvRows, 1, ends_lines=True, remedy=f"{_CSV_COLUMNS}; {TABLES}", others="timestamp,"
    ),
    ".db": _Format("python-can SQLite", SqliteRows, 1, text=False),
    ".mf4": _Format("MF4", _mf4_reader, 1, text=False),
}


class ForeignLog:
    """A log file, read anew by each iteration.

    Afterwards `notes` says what could not be read, and where.
    """

    def __init__(self, path: Path) -> None:
        suffix = Path(path.stem).suffix if path.suffix.lower() == ".gz" else path.suffix
        self.path = path
        self.notes: list[str] = []
        self.begin_ns: int | None = 0
        self._rows = 0  # that were read, those that were left out among them
        self._first_wrong: list[tuple[Place, Exception]] = []  # at most one: a file of which nothing is read is refused
        self._format = FORMATS[suffix.lower()]

    def __iter__(self) -> Iterator[FrameBlock]:
        """Yield the frames in blocks.

        InputError where not one frame can be read.
        """
        self.notes, self._rows, self._first_wrong = [], 0, []
        notes = Notes()
        frames = 0
        fault: Exception | None = None
        lines = self._lines(notes)

        def note(what: str, kind: str) -> None:
            notes.add(self._place(lines), what, kind)
            if lines:
                lines.frame_line = lines.line

        with closing(lines) if lines else nullcontext(), reader_warnings(note):
            channels = Channels(self._format.first_channel)
            messages = self._messages(lines or self.path, channels, note)
            more = True
            while more:
                chunk, fault = _take(messages)
                if chunk:
                    frames += len(chunk)
                    yield _block(chunk, self._format)
                more = len(chunk) == CHUNK and fault is None
            self.notes += [*notes.told(), *(f"{self.path}: {told}" for told in channels.told())]
        if self._first_wrong and not frames:
            self._stopped(*self._first_wrong[0], frames)
        elif fault is not None:
            self._stopped(self._place(lines), fault, frames)
        elif lines and lines.is_cut():
            self.notes.append(f"{Place(self.path, lines.line)}: the last line is cut off and was left out")

    def _place(self, lines: LineSource | None) -> Place:
        """Return where the reading is: the line, or the frame by its number from 0."""
        return Place(self.path, lines.line) if lines else Place(self.path, frame=self._rows)

    def _lines(self, notes: Notes) -> LineSource | None:
        if self._format.text:
            others = re.compile(self._format.others)
            return LineSource(self.path, notes, ends_lines=self._format.ends_lines, others=others)
        require_file(self.path)  # here, where the error is of one kind, whichever library reads it
        return None

    def _messages(self, source: LineSource | Path, channels: Channels, note: Note) -> Iterator[can.Message]:
        lines = source if isinstance(source, LineSource) else None
        with self._format.reader(source) as reader:
            for row in reader:
                try:
                    if isinstance(row, WrongRowError):
                        raise row
                    if lines:
                        lines.took_frame()
                    if _is_held(row, self._format, channels, note):
                        yield row
                except WrongRowError as error:
                    self._first_wrong = self._first_wrong or [(self._place(lines), error)]
                    note(f"a frame was left out: {error}", error.rule)
                self._rows += 1

    def _stopped(self, place: Place, fault: Exception, frames: int) -> None:
        what = f"is not readable as {self._format.name} from here: {shortened(str(fault) or type(fault).__name__, 200)}"
        if not frames:
            raise InputError(Problem(what, place, remedy=self._format.remedy)) from None
        self.notes.append(f"{place}: {what}; the {frames} frames before are kept")


def frames_of_text(text: str, suffix: str, channels: Channels, note: Note) -> tuple[FrameBlock, str]:
    """Return the frames in lines of text, and why python-can stopped, if it did.

    `note` takes warnings.
    """
    known = FORMATS[suffix]
    with reader_warnings(note), known.reader(StringIO(text, newline=None)) as reader:
        messages, fault = _take(message for message in reader if _is_held(message, known, channels, note))
    return _block(messages, known), shortened(str(fault) or type(fault).__name__) if fault else ""


def _is_held(message: can.Message, known: _Format, channels: Channels, note: Note) -> bool:
    """Make a number of a message's channel; return False, and note it, without one.

    Raises WrongRowError for a message that is not whole or that no bus can carry.
    """
    length, most = len(message.data), 64 if message.is_fd else 8
    if length > most:
        raise WrongRowError(f"a {'CAN FD' if message.is_fd else 'classic'} frame must have 0 to {most} bytes", length)
    most = 64 if message.is_fd or known.is_scanned else 15
    if not 0 <= message.dlc <= most:
        raise WrongRowError(f"a length must be 0 to {most}", message.dlc)
    announced = _announced(message, known)
    if length < announced or (length > announced and not known.is_scanned and not message.is_error_frame):
        raise WrongRowError("a payload must be as long as announced", f"{length} bytes of {message.dlc}")
    is_short = not (message.is_extended_id or message.is_error_frame)
    most = MAX_STANDARD if is_short else MAX_IDENT
    if not 0 <= message.arbitration_id <= most:
        kind = "a standard" if is_short else "an extended"
        raise WrongRowError(f"{kind} identifier must be 0 to {most:X}", f"{message.arbitration_id:X}")
    if not abs(message.timestamp) < MAX_SECONDS:  # nan, too
        raise WrongRowError(f"a time stamp must be less than {MAX_SECONDS:.0e} s", message.timestamp)
    name = message.channel + known.subtracted if isinstance(message.channel, int) else message.channel or ""
    channel = channels.number(str(name))
    if channel is None:
        note(too_far(str(name)), FAR)
        return False
    message.channel = channel
    return True


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
