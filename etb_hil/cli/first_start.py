"""A first start in two processes.

One compiles what judges a unit while the other compiles all else.
"""

from __future__ import annotations

import logging
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager

from etb_hil.base.own_process import command_of
from etb_hil.base.side_by_side import cores
from etb_hil.cli.compiling import COMPILED
from etb_hil.cli.progress_line import ProgressLine, progress_line


@contextmanager
def compiling_shared() -> Iterator[None]:
    """Share what has to be compiled with a second process, and show progress.

    The second process compiles what judges a unit.

    The second process begins with the first function that is compiled here, and has ended when the block is left: no
    unit moves beside it. It needs a second core. Each process finds in the cache what the other has compiled.
    """
    with progress_line() as line:
        sharing = _Sharing(line)
        COMPILED.addHandler(sharing)
        try:
            yield
        finally:
            COMPILED.removeHandler(sharing)
            sharing.end()


class _Sharing(logging.Handler):
    """Count the functions that are compiled; start the second process at the first."""

    def __init__(self, line: ProgressLine) -> None:
        super().__init__()
        self._line, self._count, self._begun = line, 0, 0.0
        self._second: subprocess.Popen[bytes] | None = None

    def emit(self, record: logging.LogRecord) -> None:  # noqa: ARG002 (the signature of a handler)
        """Count one function."""
        if not self._count:
            self._begun = time.monotonic()
            self._second = _second_process() if cores() > 1 else None
        self._count += 1
        self._line.show(f"Compiling: {self._count} functions in {time.monotonic() - self._begun:.0f} s")

    def end(self) -> None:
        """End the second process, wherever it is: what it has compiled is in the cache."""
        if self._second is not None:
            self._second.terminate()
            self._second.wait()


def _second_process() -> subprocess.Popen[bytes]:
    command = command_of("etb_hil.bench.analysis_kernels")
    nowhere = subprocess.DEVNULL
    return subprocess.Popen(command, stdin=nowhere, stdout=nowhere, stderr=nowhere)  # noqa: S603 (our own program)
