"""The interlock: a guard or a key switch.

The interlock must be closed before the bridge goes on, and while it is on.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from etb_hil.bench.supervision import Trip
from etb_hil.recording.samples import SampleBlock

ROLE = "interlock"
CLOSED = 0.5  # between open, 0, and closed, 1; a bad sample is not closed


class Interlock:
    """Follows the role `interlock`; samples older than `age_ns` say nothing."""

    def __init__(self, age_ns: int) -> None:
        self._age_ns = age_ns
        self._newest_ns: int | None = None
        self._opened = False

    def push(self, blocks: Iterable[SampleBlock]) -> None:
        """Take new samples; it has opened where one of them says so."""
        new = [block for block in blocks if ROLE in block.columns and len(block)]
        if new:
            self._newest_ns = int(new[-1].stamp_ns[-1])
            self._opened = not all(bool(np.all(block.columns[ROLE] > CLOSED)) for block in new)

    def trip(self, now_ns: int) -> Trip | None:
        """Return why the bridge may not be on at this time, if so."""
        if self._newest_ns is None or abs(now_ns - self._newest_ns) > self._age_ns:
            return Trip("interlock_silent", f"no sample of the interlock for {self._age_ns * 1e-6:.0f} ms")
        return Trip("interlock_open", "the interlock is open") if self._opened else None
