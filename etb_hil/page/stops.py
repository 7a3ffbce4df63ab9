"""Signals of STOP and of "end in order" while a run's process starts.

A process that has no handler yet dies of SIGUSR1, and of SIGINT before Python has begun. The page therefore blocks both
while it starts the process, which inherits that: a press waits in the kernel until the run takes it.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager

STOPS = (signal.SIGINT, signal.SIGUSR1)


@contextmanager
def held_back() -> Iterator[None]:
    """Block the signals in this thread, and in processes that it starts meanwhile."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, STOPS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def take_stops() -> None:
    """Raise KeyboardInterrupt at a press from now on, and at one that was held back."""
    for number in STOPS:
        signal.signal(number, signal.default_int_handler)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPS)
