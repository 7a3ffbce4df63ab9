"""The supply's window, outside which the bridge may not be on.

That holds however short each time is.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from etb_hil.recording.samples import SampleBlock
from etb_hil.scenario.condition import Condition
from etb_hil.scenario.condition_watch import Firing

ROLE = "supply_voltage"


class SupplyGuard:
    """Follow the supply against the condition under which it is outside.

    The bridge may be on or off.

    A bad sample does not show that it is inside, and neither does a gap. Before the first good one, nothing is known.
    """

    def __init__(self, condition: Condition) -> None:
        self.condition = condition
        self._low, self._high = condition.outside or (-float("inf"), float("inf"))
        self._hold_ns = round(condition.for_ * 1e9)
        self._outside_since_ns: int | None = None
        self.is_known = False  # whether a good sample has come
        self.outside: Firing | None = None  # since when it has been outside for as long as it may be, and how far

    def push(self, blocks: Iterable[SampleBlock]) -> None:
        """Take new samples."""
        for block in blocks:
            if ROLE in block.columns:
                columns = block.stamp_ns, block.time_ns, block.columns[ROLE]
                for stamp_ns, time_ns, value in zip(*(one.tolist() for one in columns), strict=True):
                    self._take(stamp_ns, time_ns, value)

    def is_inside(self, blocks: Iterable[SampleBlock]) -> bool:
        """Return whether the supply is inside now and in all of new samples."""
        values = [block.columns[ROLE] for block in blocks if ROLE in block.columns]
        is_now = self.is_known and self._outside_since_ns is None
        return is_now and all(bool(np.all((self._low <= each) & (each <= self._high))) for each in values)

    def __str__(self) -> str:
        """Say what the supply is, and what it should be."""
        value = float("nan") if self.outside is None else self.outside.value
        now = f"supply at {value:.2f} V" if value == value else "no reading of the supply"  # noqa: PLR0124 (NaN)
        return f"{now}, outside {self._low:g} to {self._high:g} V"

    def _take(self, stamp_ns: int, time_ns: int, value: float) -> None:
        self.is_known = self.is_known or math.isfinite(value)
        if self._low <= value <= self._high:
            self._outside_since_ns = self.outside = None
            return
        since_ns = self._outside_since_ns
        self._outside_since_ns = time_ns if since_ns is None else min(since_ns, time_ns)
        if self.outside is None and time_ns - self._outside_since_ns >= self._hold_ns:
            self.outside = Firing(stamp_ns, value)
