"""One line at the bottom of a terminal that says how far long work is.

In a file there is a line now and then.
"""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

_REDRAWN_S = 0.1
_IN_A_FILE_S = 30.0  # between two lines where nobody watches them change


class ProgressLine:
    """Say progress on standard error; standard output has results alone."""

    def __init__(self) -> None:
        self._is_seen, self._shown = sys.stderr.isatty(), ""
        self._last = float("-inf") if self._is_seen else time.monotonic()

    def show(self, text: str) -> None:
        """Show a text in the place of the one before, as often as somebody can read it."""
        now = time.monotonic()
        if now - self._last < (_REDRAWN_S if self._is_seen else _IN_A_FILE_S):
            return
        self._last = now
        if self._is_seen:
            text = text[: shutil.get_terminal_size().columns - 1]
            print(f"\r{text:<{len(self._shown)}}", end="", file=sys.stderr, flush=True)
            self._shown = text
        else:
            print(text, file=sys.stderr, flush=True)

    def above(self, text: str) -> None:
        """Print a result, which stays; the line is drawn again below it."""
        self.clear()
        print(text, flush=True)
        self._last = float("-inf") if self._is_seen else self._last

    def clear(self) -> None:
        """Take the line off the terminal."""
        if self._shown:
            print(f"\r{'':<{len(self._shown)}}\r", end="", file=sys.stderr, flush=True)
            self._shown = ""


@contextmanager
def progress_line() -> Iterator[ProgressLine]:
    """Yield a line that is gone at the end, also where the work is broken off."""
    line = ProgressLine()
    try:
        yield line
    finally:
        line.clear()


def duration(seconds: float) -> str:
    """Return a time left as people say it: 40 s, 3 min, 2 h 05 min."""
    if seconds < 60.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"
