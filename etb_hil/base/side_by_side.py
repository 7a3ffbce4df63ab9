"""Work on several items at a time, on as many cores as the process may use.

This is for compiled code without Python's lock.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")

_MOST = 8  # each has its arrays: beyond it a long record costs more memory than the cores gain

_here = threading.local()


def cores() -> int:
    """Return on how many cores items are worked on at a time."""
    if hasattr(os, "sched_getaffinity"):
        return min(len(os.sched_getaffinity(0)), _MOST)
    return min(os.cpu_count() or 1, _MOST)


def side_by_side(work: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
    """Yield what some work makes of each item, in their order.

    After one that raises no more are begun.

    Those that were begun by then are waited for. Work inside such work goes on one after another, so that there are
    never more threads than cores. `work` must not change what another item reads.
    """
    waiting = list(items)
    count = min(cores(), len(waiting))
    if count < 2 or getattr(_here, "is_worker", False):
        yield from map(work, waiting)
        return
    pool = ThreadPoolExecutor(count, "side_by_side", initializer=_mark)
    try:
        yield from pool.map(work, waiting)
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _mark() -> None:
    _here.is_worker = True
