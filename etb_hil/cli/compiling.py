"""Tell on standard error that functions are being compiled.

Nobody should wonder why nothing happens.
"""

from __future__ import annotations

import logging
import sys

COMPILED = logging.getLogger("etb_hil.base.compiled")  # one record for each function that has to be compiled


class _Notice(logging.Handler):
    _is_given = False

    def emit(self, record: logging.LogRecord) -> None:  # noqa: ARG002 (the signature of a handler)
        """Print one line at the first function that is compiled."""
        if self._is_given:
            return
        self._is_given = True
        print("Compiling for this machine. Later starts take the machine code from a cache.", file=sys.stderr)


def announce_compiling() -> None:
    """Print a line to standard error as soon as this process compiles something."""
    COMPILED.addHandler(_Notice())
    COMPILED.setLevel(logging.INFO)
    COMPILED.propagate = False
