"""Keep the garbage collector out of the way of work that makes no cycle.

Such work makes many objects.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

# Imports make objects that stay, 180,000 of them in `run`, and the collector of cycles would walk all of them in vain.
# Python's threshold is 700 (`benchmarks/where_users_wait.py`).
_THRESHOLD = (200_000, 20, 20)


def collect_rarely() -> None:
    """Let the collector wait for more objects than imports make.

    This holds for this process.
    """
    gc.set_threshold(*_THRESHOLD)


@contextmanager
def collector_paused() -> Iterator[None]:
    """Pause the collector.

    The collector would walk all objects again and again while they become more.

    It takes half of the time in which the history of 10,000 runs is made (`benchmarks/store_speed.py`).
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()
