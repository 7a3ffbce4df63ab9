"""Logs in text, candump's and Vector's ASC, at the speed of a compiled scanner.

Lines that the scanner does not take are read by python-can, one by one, so that every file gives what python-can reads
of it. One that it refuses is left out and noted: a damaged line costs no other. Importing python-can takes longer than
most logs, which is why it happens only there.
"""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from typing import IO, TYPE_CHECKING, cast

import numpy as np

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.userfile import open_file, refuse_utf_16
from etb_hil.canio.frames import FrameBlock, concatenate_frames
from etb_hil.canio.logs import text_scan as scan
from etb_hil.canio.logs.asc_header import base_of, is_other_event, read_header
from etb_hil.canio.logs.asc_scan import key_of_number, scan_asc
from etb_hil.canio.logs.candump_scan import scan_candump
from etb_hil.canio.logs.channels import MOST, Channels
from etb_hil.canio.logs.gunzip import BROKEN, Gunzip
from etb_hil.canio.logs.line_source import LEFT_OUT, OddLines, left_out
from etb_hil.canio.logs.notes import Notes

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

CHUNK_BYTES = 256 << 10  # which stays in the processor's cache
MAX_LINE_BYTES = 1 << 16  # a longer line is no line: what claims to be text may be anything
_TAB, _NEWLINE, _RETURN, _SPACE, _DELETE = 9, 10, 13, 32, 127

# An ASC log may end without an end of line; what ends so was cut off: half a byte (the first one stands behind the
# frame's length), or a remote frame's missing length.
_HALF = re.compile(
    rb"(\b[0-9A-F]{2} +[0-9A-F]|\sd\s+\w+\s+[0-9A-F]|\sr\s*"
    rb"|\scanfd(\s+\w+){3,4}\s+[01]\s+[01]\s+[0-9A-F]\s+\d+\s+[0-9A-F])\Z",
    re.IGNORECASE,
)
_EVENT = re.compile(rb"\s*\d")  # of an ASC log: it starts with its time
# Where a line names its channel. An interface of candump may be called `canfd`, which in ASC is a word before it.
_CHANNEL = {".asc": re.compile(rb"\s*\S+\s+(?:canfd\s+)?(\S+)", re.IGNORECASE), ".log": re.compile(rb"\s*\S+\s+(\S+)")}
_CHECK = "check that the file is what its name says"
_DAMAGED = "damaged"  # kind of a note


class TextLog:
    """A log in text, read anew by each iteration.

    Afterwards `notes` says what could not be read, and where.

    The path ends in `.asc` or `.log`, or in `.gz` behind that: then it is unpacked on the way.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._suffix = (path.with_suffix("") if path.suffix.lower() == ".gz" else path).suffix.lower()
        self._begin_anew()

    def _begin_anew(self) -> None:
        self.notes: list[str] = []
        self._frames, self._line, self._base, self._width, self._fault = 0, 0, 16, 8, ""
        self._is_open = False  # the last line has no end
        self._odd_lines = OddLines()
        self._odd, self._is_noted = Notes(), False  # what was left out, and whether that was said of the odd line
        self._first_damage: Problem | None = None  # the first line that python-can refused
        self._is_header = self._suffix == ".asc"
        self.begin_ns: int | None = None if self._is_header else 0
        self._channels = Channels(first=1 if self._suffix == ".asc" else 0)
        self._keys = np.zeros(MOST, np.uint64)

    def __iter__(self) -> Iterator[FrameBlock]:
        """Yield the frames in blocks of bounded size.

        InputError where not even the first frame can be read.
        """
        self._begin_anew()
        yield from self._blocks()
        if not self._frames and self._first_damage is not None:
            raise InputError(self._first_damage)
        self.notes += [*self._odd.told(), *(f"{self.path}: {told}" for told in self._channels.told())]

    def _blocks(self) -> Iterator[FrameBlock]:
        for text in self._chunks():
            if not self._line:
                text = self._encoded(text)  # noqa: PLW2901 (a mark of its encoding is no part of it)
            if self._is_header:
                text = text[self._header(text) :]  # noqa: PLW2901 (the header is no part of the events)
            frames = concatenate_frames(self._parts(text))
            if self._is_open and not len(frames) and not self._fault and _EVENT.match(text):
                self._cut_off(self._line)
            self._frames += len(frames)
            if len(frames):
                self._odd_lines.take(is_odd=False)
                yield frames
            if self._fault:
                self._stopped()
                return

    def _encoded(self, text: bytes) -> bytes:
        """Return the first text without a mark of its encoding; InputError of UTF-16."""
        refuse_utf_16(self.path, text)
        return text.removeprefix(BOM_UTF8)

    def _chunks(self) -> Iterator[bytes]:
        """Yield whole lines, about a chunk at a time.

        The last line too, unless it was cut off.
        """
        is_packed = self.path.suffix.lower() == ".gz"
        with cast("IO[bytes]", Gunzip(self.path) if is_packed else open_file(self.path)) as file:
            rest = b""
            while True:
                try:
                    read = file.read(CHUNK_BYTES)
                except BROKEN as error:
                    read = b""
                    self.notes.append(f"{self.path}: the file is damaged: {error}; what came before is kept")
                end = read.rfind(b"\n") + 1
                if end:
                    yield rest + read[:end]
                rest = read[end:] if end else rest + read
                if not read or len(rest) > MAX_LINE_BYTES:
                    break
        if len(rest) > MAX_LINE_BYTES:
            self._fault = "a line without an end"
            self._stopped()
        elif rest and (self._suffix == ".log" or _HALF.search(rest)):
            self._cut_off(self._line + 1)
        elif rest:
            self._is_open = True
            yield rest + b"\n"

    def _cut_off(self, line: int) -> None:
        self.notes.append(f"{Place(self.path, line)}: the last line is cut off and was left out")

    def _header(self, text: bytes) -> int:
        """Take in whole lines of an ASC log's header and return where its events start."""
        header = read_header(text)
        self._base = header.base or self._base
        if header.begin_ns is not None:
            self.begin_ns = header.begin_ns
        if header.is_running:
            self.notes.append(f"{self.path}: its stamps count from the event before and were taken as they stand")
        for line, what in header.unknown:
            self._odd.add(Place(self.path, self._line + line), left_out(what.decode("utf-8", "replace")), LEFT_OUT)
        self._line += header.lines
        self._is_header = header.size == len(text)
        return header.size

    def _parts(self, text: bytes) -> Iterator[FrameBlock]:
        """Yield the frames of whole lines, up to a line that stops the reading."""
        raw = np.frombuffer(text, np.uint8)
        newlines = np.flatnonzero(raw == _NEWLINE)
        plain = _is_plain(raw, newlines)
        first, state = self._line, np.zeros(3, np.int64)
        passed = np.empty(len(newlines), np.int64)
        while True:
            block = _columns(len(newlines) - int(state[scan.LINE]), self._width)
            state[scan.ROWS] = 0
            columns = (block.stamp_ns, block.ident, block.flags, block.length, block.data, block.channel)
            if self._suffix == ".asc":
                reason = scan_asc(raw, newlines, plain, self._base, self._keys, columns, passed, state)
            else:
                reason = scan_candump(raw, newlines, plain, self._keys, columns, state)
            yield block.select(slice(int(state[scan.ROWS])))
            line = int(state[scan.LINE])
            for other in passed[: int(state[scan.PASSED])].tolist():
                self._line, self._is_noted = first + other + 1, False
                self._passed_over(_line(text, newlines, other))
                if self._fault:
                    return
            state[scan.PASSED] = 0
            self._line = first + line
            if reason == scan.DONE:
                return
            if reason == scan.WIDE:
                self._width = 64
                continue
            if reason == scan.CHANNEL and self._is_numbered(_line(text, newlines, line)):
                continue
            self._line += 1
            yield self._odd_line(_line(text, newlines, line))
            if self._fault:
                return
            state[scan.LINE] += 1

    def _is_numbered(self, line: bytes) -> bool:
        """Give the channel of a line its number; False where there is none for it."""
        found = _CHANNEL[self._suffix].match(line)
        name = b"" if found is None else found[1]
        number = self._channels.number(name.decode("utf-8", "replace"))
        if number is None:
            return False
        if self._suffix == ".asc":
            self._keys[number] = key_of_number(np.int64(int(name)))
        else:
            self._keys[number] = scan.key_of(np.frombuffer(name, np.uint8))
        return True

    def _odd_line(self, line: bytes) -> FrameBlock:
        """Return what python-can makes of a line; one that it refuses is left out."""
        from etb_hil.canio.logs.foreign import frames_of_text  # noqa: PLC0415 (importing can is slow)

        self._is_noted = False
        if len(line) > MAX_LINE_BYTES:
            self._fault = f"a line of {len(line)} bytes"
            return FrameBlock.empty()
        if self._suffix == ".asc" and (base := base_of(line)) is not None:
            self._base = base
            return FrameBlock.empty()
        head = (
            f"base {'dec' if self._base == 10 else 'hex'}\ninternal events logged\n" if self._suffix == ".asc" else ""
        )
        text = head + line.decode("utf-8", "replace")
        frames, refused = frames_of_text(text, self._suffix, self._channels, self._note)
        if refused:
            self._note(f"is not readable as {self._name} and was left out: {refused}", _DAMAGED)
        if not len(frames):
            self._passed_over(line, is_refused=bool(refused))
        return frames

    def _note(self, what: str, kind: str) -> None:
        self._is_noted = True
        if kind == _DAMAGED and self._first_damage is None:
            self._first_damage = Problem(what, Place(self.path, self._line), remedy=_CHECK)
        self._odd.add(Place(self.path, self._line), what, kind)

    def _passed_over(self, line: bytes, *, is_refused: bool = False) -> None:
        """Note a line that gave no frame, unless it is one of those that hold none.

        Too many lines in a row that are empty or unknown end the reading.
        """
        is_empty = not line.strip()
        is_known = is_other_event(line) if self._suffix == ".asc" else is_empty
        if not self._is_noted and not is_known:
            self._note(left_out(line.decode("utf-8", "replace")), LEFT_OUT)
        try:
            self._odd_lines.take(is_odd=is_refused or is_empty or not is_known)
        except ValueError as error:
            self._fault = str(error)

    @property
    def _name(self) -> str:
        return "ASC" if self._suffix == ".asc" else "candump"

    def _stopped(self) -> None:
        place = Place(self.path, self._line, frame=self._frames)
        what = f"is not readable as {self._name} from here: {self._fault}"
        if not self._frames:
            raise InputError(Problem(what, place, remedy=_CHECK))
        self.notes.append(f"{place}: {what}; the {self._frames} frames before are kept")


def _line(text: bytes, newlines: NDArray[np.int64], line: int) -> bytes:
    return text[int(newlines[line - 1]) + 1 if line else 0 : int(newlines[line]) + 1]


def _is_plain(raw: NDArray[np.uint8], newlines: NDArray[np.int64]) -> bool:
    """Return whether the text is printable letters and white space alone.

    White space is spaces, tabs and ends of lines.
    """
    low, high = int(raw.min(initial=_DELETE)), int(raw.max(initial=0))
    if high >= _DELETE:
        return False
    control = np.count_nonzero(raw < _SPACE) - len(newlines)
    if not control:
        return low >= _TAB
    returns = np.count_nonzero(raw[newlines[newlines > 0] - 1] == _RETURN)
    return bool(control == returns + np.count_nonzero(raw == _TAB))


def _columns(rows: int, width: int) -> FrameBlock:
    return FrameBlock(
        np.empty(rows, np.int64),
        np.empty(rows, np.uint32),
        np.empty(rows, np.uint8),
        np.empty(rows, np.uint8),
        np.empty((rows, width), np.uint8),
        np.empty(rows, np.uint8),
    )
