"""What surrounds python-can's readers of logs.

Lines are counted, a cut end is seen, warnings are kept.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BufferedReader, TextIOWrapper
from pathlib import Path

from etb_hil.base.errors import Place, shortened
from etb_hil.base.userfile import open_file
from etb_hil.canio.logs.gunzip import Gunzip
from etb_hil.canio.logs.notes import Notes

MAX_LINE = 1 << 16  # letters; a longer line is no line
MOST_ODD_LINES = 500_000  # without a meaning, in a row, that are still read: python-can takes 30 us for each
LEFT_OUT = "holds no frame that can be read and was left out"
_HALF_BYTE = re.compile(r"(\b[0-9A-Fa-f]{2}|\s[0-9])\s+[0-9A-Fa-f]\Z")  # behind another byte, or the length


class OddLines:
    """Count lines in a row that are empty or hold nothing that is known."""

    def __init__(self) -> None:
        self._count = 0

    def take(self, *, is_odd: bool) -> None:
        """Take a line; ValueError where too many odd ones follow each other."""
        self._count = self._count + 1 if is_odd else 0
        if self._count > MOST_ODD_LINES:
            raise ValueError(f"{MOST_ODD_LINES} lines without a frame")


def left_out(line: str) -> str:
    """Say of a line that it was left out."""
    return f"{LEFT_OUT}: {shortened(repr(line.strip()))}"


class LineSource:
    """The lines of a text file, plain or gzip, counted in `line`.

    A last line that was cut off is left out.

    A line without an end is cut off where the format always ends its lines, else where it stops within a byte. Lines
    that gave no frame are noted, except those that `others` matches from their start.
    """

    def __init__(self, path: Path, notes: Notes, *, ends_lines: bool, others: re.Pattern[str]) -> None:
        self._path, self._notes, self._others = path, notes, others
        raw = BufferedReader(Gunzip(path)) if path.suffix.lower() == ".gz" else open_file(path)
        self._file = TextIOWrapper(raw, encoding="utf-8", errors="replace")
        self._ends_lines = ends_lines
        self.line = self.frame_line = 0  # `frame_line` is for who finds a frame in the line, or notes it
        self._text = ""
        self._odd = OddLines()
        self._cut = self._is_open = self._has_frame = False

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        if self._text:
            self._look_back()
        self._text = text = self._file.readline(MAX_LINE)
        if not text:
            raise StopIteration
        self.line += 1
        if len(text) == MAX_LINE:
            raise ValueError(f"a line of {MAX_LINE} letters or more")
        if not text.endswith("\n"):
            if self._ends_lines or _HALF_BYTE.search(text):
                self._cut, self._text = True, ""
                raise StopIteration
            self._is_open = text.lstrip()[:1].isdigit()
        return text

    def took_frame(self) -> None:
        """Note that the line holds a frame."""
        self.frame_line, self._has_frame = self.line, True

    def _look_back(self) -> None:
        is_known = self._others.match(self._text) is not None
        if self.frame_line != self.line and not is_known:
            self._notes.add(Place(self._path, self.line), left_out(self._text), LEFT_OUT)
        self._odd.take(is_odd=not self._has_frame and not (is_known and self._text.strip()))
        self._has_frame = False

    def is_cut(self) -> bool:
        """Return whether the last line was cut off.

        The line was left out, or it looks like a frame and was none.
        """
        return self._cut or (self._is_open and self.frame_line != self.line)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


@contextmanager
def reader_warnings(note: Callable[[str, str], None]) -> Iterator[None]:
    """Pass on what python-can's readers log, and its kind.

    They skip a line that they cannot read and go on.
    """

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            note(record.getMessage(), str(record.msg))

    collector = Collector(logging.WARNING)
    logger = logging.getLogger("can.io")
    logger.addHandler(collector)
    try:
        yield
    finally:
        logger.removeHandler(collector)
