"""What surrounds python-can's readers of logs: lines are counted, a cut end is seen, warnings are kept."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager
from io import BufferedReader, TextIOWrapper
from pathlib import Path

from etb_hil.canio.logs.gunzip import Gunzip

MAX_WARNINGS = 20
_HALF_BYTE = re.compile(r"(\b[0-9A-Fa-f]{2}|\s[0-9])\s+[0-9A-Fa-f]\Z")  # behind another byte, or the length


class LineSource:
    """The lines of a text file, plain or gzip, counted in `line`; a last line that was cut off is left out.

    A line without an end is cut off where the format always ends its lines, else where it stops within a byte.
    """

    def __init__(self, path: Path, *, ends_lines: bool) -> None:
        raw = BufferedReader(Gunzip(path)) if path.suffix.lower() == ".gz" else path.open("rb")
        self._file = TextIOWrapper(raw, encoding="utf-8", errors="replace")
        self._ends_lines = ends_lines
        self.line = self.frame_line = 0  # `frame_line` is for who finds a frame in the line
        self._cut = self._is_open = False

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        text = next(self._file)
        self.line += 1
        if not text.endswith("\n"):
            if self._ends_lines or _HALF_BYTE.search(text):
                self._cut = True
                raise StopIteration
            self._is_open = text.lstrip()[:1].isdigit()
        return text

    def is_cut(self) -> bool:
        """Return whether the last line was cut off: it was left out, or it looks like a frame and was none."""
        return self._cut or (self._is_open and self.frame_line != self.line)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


@contextmanager
def reader_warnings() -> Iterator[list[str]]:
    """Collect what python-can's readers log: they skip a line that they cannot read and go on."""
    warnings: list[str] = []

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            if len(warnings) < MAX_WARNINGS:
                warnings.append(record.getMessage())

    collector = Collector(logging.WARNING)
    logger = logging.getLogger("can.io")
    logger.addHandler(collector)
    try:
        yield warnings
    finally:
        logger.removeHandler(collector)
