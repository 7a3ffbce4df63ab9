"""Tell on standard error that functions are being compiled.

Nobody should wonder why nothing happens.
"""

from __future__ import annotations

import gc
import logging
import sys

# Compiling makes objects that stay, and the collector of cycles walks them again and again. With this threshold
# (Python's is 700) a first start takes 5 % less time, and 20 MB more (`benchmarks/where_users_wait.py --first`).
_COLLECTOR = (10_000, 20, 20)

COMPILED = logging.getLogger("etb_hil.base.compiled")  # one record for each function that has to be compiled


class _Notice(logging.Handler):
    _is_given = False

    def emit(self, record: logging.LogRecord) -> None:  # noqa: ARG002 (the signature of a handler)
        """Print one line at the first function that is compiled."""
        if self._is_given:
            return
        self._is_given = True
        gc.set_threshold(*_COLLECTOR)
        print("Compiling for this machine. Later starts take the machine code from a cache.", file=sys.stderr)


def announce_compiling() -> None:
    """Print a line to standard error as soon as this process compiles something."""
    COMPILED.addHandler(_Notice())
    COMPILED.setLevel(logging.INFO)
    COMPILED.propagate = False
