"""Clocks that are handed in: no code asks the machine for the time.

The same code runs in lock-step and at wall clock.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Protocol

_READINGS = 4  # of two clocks: a process may be held between two readings, but hardly each time


class Clock(Protocol):
    """A source of time in integer nanoseconds."""

    def now_ns(self) -> int:
        """Return the present time in nanoseconds since the epoch of this clock."""
        ...

    def sleep_until_ns(self, deadline_ns: int) -> None:
        """Return when `now_ns` has reached the deadline.

        On a virtual clock this moves the world forward.
        """
        ...


def stored_time(text: str) -> datetime:
    """Return a time of a file or a store, with its offset.

    Without one it is UTC, as the program writes it. Only
    such times can be compared with each other. ValueError where the text is no time as ISO 8601 has it.
    """
    at = datetime.fromisoformat(text)
    return at if at.tzinfo is not None else at.replace(tzinfo=UTC)


def host_ahead_ns(now_ns: Callable[[], int]) -> tuple[int, int]:
    """Return the least and the most in ns that the machine's clock is ahead of one.

    They are those of the closest of some readings.
    """
    readings = [(now_ns(), time.time_ns(), now_ns()) for _ in range(_READINGS)]
    before, host, after = min(readings, key=lambda one: one[2] - one[0])
    return host - after, host - before


class WallClock:
    """The machine's clock: epoch time that never steps back while the process lives."""

    def __init__(self) -> None:
        self._offset_ns, _ = host_ahead_ns(time.monotonic_ns)

    def now_ns(self) -> int:
        """Return ns since 1970 as at the start, advanced by the monotonic clock."""
        return time.monotonic_ns() + self._offset_ns

    def sleep_until_ns(self, deadline_ns: int) -> None:
        """Sleep to an absolute deadline, so that lateness does not add up."""
        while (left_ns := deadline_ns - self.now_ns()) > 0:
            time.sleep(left_ns * 1e-9)
