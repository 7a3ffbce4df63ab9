"""A claim on work that many processes are about to do.

One process does it, and the others wait for what it makes.
"""

from __future__ import annotations

import contextlib
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

if sys.platform != "win32":
    import fcntl

_LONGEST_S = 120.0  # behind it a process does the work itself: whoever has the claim may hang
_POLL_S = 0.05


class Claim:
    """The claim on a file that does not exist yet.

    It ends with the process, at the latest.
    """

    def __init__(self, path: Path) -> None:
        self._path = path.with_name(f"{path.name}.claim")
        self._descriptor: int | None = None

    def take(self, is_made: Callable[[], bool]) -> None:
        """Return once the claim is ours, or not needed any more.

        That is where somebody else has made the file, or where no file can be written. On Windows every process does
        its own work.
        """
        if sys.platform == "win32":
            return
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._descriptor = os.open(self._path, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o666)
        except OSError:  # read-only, or full
            return
        until = time.monotonic() + _LONGEST_S
        while not is_made() and time.monotonic() < until:
            with contextlib.suppress(OSError):  # somebody else has it
                fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return
            time.sleep(_POLL_S)

    def end(self) -> None:
        """Give the claim back."""
        if self._descriptor is not None:
            with contextlib.suppress(OSError):
                self._path.unlink()
            os.close(self._descriptor)
            self._descriptor = None
