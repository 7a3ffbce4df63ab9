"""Lateness of the host at its own deadlines.

Lateness is the host's grade at wall clock, and no part of a verdict.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Int64 = NDArray[np.int64]

STALL_NS = 5_000_000  # later than this the host stalled; below it is an ordinary scheduler


@dataclass(slots=True)
class Lateness:
    """Counts how late each wait came back from its deadline, in ns."""

    waits: int = 0
    sum_ns: int = 0
    worst_ns: int = 0
    stalls: int = 0

    def note(self, late_ns: int) -> None:
        """Count one wait that ended `late_ns` after its deadline."""
        self.waits += 1
        self.sum_ns += late_ns
        self.worst_ns = max(self.worst_ns, late_ns)
        self.stalls += late_ns > STALL_NS

    def note_all(self, late_ns: Int64) -> None:
        """Count waits (n)."""
        self.waits += len(late_ns)
        self.sum_ns += int(late_ns.sum())
        self.worst_ns = max(self.worst_ns, int(late_ns.max(initial=0)))
        self.stalls += int((late_ns > STALL_NS).sum())

    @property
    def mean_ns(self) -> int:
        """Mean lateness in ns, 0 before the first wait."""
        return self.sum_ns // self.waits if self.waits else 0

    def __str__(self) -> str:
        if not self.waits:
            return "never woken"
        mean_ms, worst_ms = self.mean_ns * 1e-6, self.worst_ns * 1e-6
        return (
            f"{self.waits} wakes, late by {mean_ms:.3f} ms on average, {worst_ms:.1f} ms at worst, {self.stalls} stalls"
        )
