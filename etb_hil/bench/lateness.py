"""How late the host was at its own ticks: the bench's grade, and no part of a verdict."""

from __future__ import annotations

from etb_hil.base.clock import Clock


class Lateness:
    """Waits for deadlines and keeps how late each wait came back."""

    def __init__(self) -> None:
        self.ticks = 0
        self.worst_ns = 0
        self._sum_ns = 0

    def wait(self, clock: Clock, deadline_ns: int) -> int:
        """Sleep until the deadline; return the time at which the sleep ended."""
        clock.sleep_until_ns(deadline_ns)
        now_ns = clock.now_ns()
        late_ns = max(now_ns - deadline_ns, 0)
        self.ticks += 1
        self.worst_ns = max(self.worst_ns, late_ns)
        self._sum_ns += late_ns
        return now_ns

    @property
    def mean_ns(self) -> int:
        """Mean lateness in ns, 0 before the first tick."""
        return self._sum_ns // self.ticks if self.ticks else 0
