"""The keys of a terminal, one at a time and unseen, as a run screen needs them."""

from __future__ import annotations

import contextlib
import os
import select
import sys
from types import TracebackType
from typing import Self


def somebody_attends() -> bool:
    """Return whether a terminal's keyboard is ours to read.

    Such a keyboard is not a pipe's end, and not another job's.
    """
    if sys.platform == "win32" or sys.stdin is None or not sys.stdin.isatty():
        return False
    try:
        return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    except OSError:  # a terminal, and not the one that controls this process: nobody's keys come from there
        return False


class Keyboard:
    r"""Read keys from a descriptor.

    While entered, a terminal neither waits for Enter nor shows what is typed.

    Ctrl-C and Ctrl-\ stay signals. What was typed and not read is dropped at the end: it was not meant for what
    comes next.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor

    def __enter__(self) -> Self:
        import termios
        import tty

        self._before = termios.tcgetattr(self._descriptor)
        tty.setcbreak(self._descriptor, termios.TCSADRAIN)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        import termios

        with contextlib.suppress(termios.error):  # a terminal that was closed has nothing to put back
            termios.tcsetattr(self._descriptor, termios.TCSAFLUSH, self._before)

    def read(self, wait_s: float = 0.0) -> str:
        """Return what was typed since, waiting for it no longer than so many seconds."""
        if not select.select([self._descriptor], [], [], wait_s)[0]:
            return ""
        try:
            typed = os.read(self._descriptor, 1024)
        except OSError:  # the terminal was closed; SIGHUP says so too
            return ""
        return typed.decode("utf-8", "replace").replace("\r", "\n")
