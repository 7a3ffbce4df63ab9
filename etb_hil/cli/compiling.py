"""Says so when the first start has to compile: nobody should wonder why nothing happens."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from etb_hil.base.compiled_cache import is_cold

PATIENCE_S = 1.0


@contextmanager
def announced() -> Iterator[None]:
    """Print a line to standard error when what runs inside has to compile, and takes more than a second."""
    if not is_cold():
        yield
        return
    timer = threading.Timer(PATIENCE_S, _say)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _say() -> None:
    print(
        "Compiling the plant, observer and codec for this machine; later starts take them from a cache.",
        file=sys.stderr,
    )
