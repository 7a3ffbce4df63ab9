"""Tells on standard error that functions are being compiled: nobody should wonder why nothing happens."""

from __future__ import annotations

import logging
import sys


class _Notice(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        """Print one line at the first function that is compiled."""
        logging.getLogger(record.name).removeHandler(self)
        print("Compiling for this machine. Later starts take the machine code from a cache.", file=sys.stderr)


def announce_compiling() -> None:
    """Print a line to standard error as soon as this process compiles something."""
    compiled = logging.getLogger("etb_hil.base.compiled")
    compiled.addHandler(_Notice())
    compiled.setLevel(logging.INFO)
    compiled.propagate = False
