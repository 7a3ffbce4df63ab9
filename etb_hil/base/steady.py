"""Keep a process at wall clock from stalling.

A process may stall by itself, or by what else the machine does.
"""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager

BENCH = 1  # the least that goes before all ordinary work
DEVICE = 2  # what stands for a device with a processor of its own goes before the bench


@contextmanager
def steady(priority: int = BENCH) -> Iterator[None]:
    """Keep this process from stalling, as far as it is allowed.

    All that is loaded so far is out of the garbage collector's sight; the process goes before ordinary work.

    A full collection walks every object of every library: 30 ms, on a slow machine 150 ms, in the middle of a motion
    whose watchdog waits for 30 ms. On a busy machine an ordinary process waits its turn for longer still. Threads and
    processes that are started inside are as urgent. Where the system does not allow it, the process stays ordinary.
    """
    gc.collect()
    gc.freeze()
    before = _go_first(priority)
    try:
        yield
    finally:
        gc.unfreeze()
        if before is not None:
            os.sched_setscheduler(0, *before)


def _go_first(priority: int) -> tuple[int, os.sched_param] | None:
    """Ask for a real-time priority.

    Return what there was before, None where nothing changed.
    """
    if not hasattr(os, "sched_setscheduler"):  # only Linux lets a process ask
        return None
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    if before[1].sched_priority >= priority:  # whoever started it knows better
        return None
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(priority))
    except OSError:  # without the privilege (CAP_SYS_NICE, or an rtprio limit)
        return None
    return before
