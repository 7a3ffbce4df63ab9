"""Find the sample that fires a condition, live and in replay.

The sample is the same one from any cut of the stream.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from etb_hil.recording.samples import SampleBlock
from etb_hil.scenario.condition import EDGES, Condition

BINS = 10  # means that a settling signal's trend is fitted to


@dataclass(frozen=True, slots=True)
class Firing:
    """The sample that made a condition true.

    The sample has a stamp in ns and a value in the role's SI unit.
    """

    stamp_ns: int
    value: float


class ConditionWatch:
    """Look at every sample stamped after `since_ns` until one fires.

    Samples after `until_ns` are not looked at, where that is set.

    Where a host's clock was set back, a sample counts as stamped when the newest before it was, as in the diagnosis.
    Of a role that several sources carry, only the samples of `source` count: between two of them there is no order
    that every cut of the stream keeps.
    """

    def __init__(self, condition: Condition, since_ns: int, source: str | None = None) -> None:
        self._condition = condition
        self._since_ns = since_ns
        self._newest_ns = since_ns
        self._source = source
        self._hold_ns = round(condition.for_ * 1e9)
        self._is_armed = condition.kind not in EDGES
        self._trend = None if condition.over is None else _Trend(round(condition.over * 1e9))
        self._true_since_ns: int | None = None
        self.until_ns: int | None = None
        self.fired: Firing | None = None

    def push(self, blocks: Iterable[SampleBlock]) -> Firing | None:
        """Take samples in the order in which they were received.

        Return the one that fired, then and ever after.
        """
        role = self._condition.role
        for block in blocks:
            if self.fired is None and role in block.columns and len(block) and self._source in (None, block.source):
                self._look(block, role)
        return self.fired

    def _look(self, block: SampleBlock, role: str) -> None:
        stamp_ns = np.maximum.accumulate(block.stamp_ns)
        stamp_ns = np.maximum(stamp_ns, self._newest_ns)
        self._newest_ns = int(stamp_ns[-1])
        first = int(np.searchsorted(stamp_ns, self._since_ns, side="right"))
        last = len(block) if self.until_ns is None else int(np.searchsorted(stamp_ns, self.until_ns, "right"))
        columns = (stamp_ns, block.time_ns, block.columns[role], block.lost_before)
        samples = zip(*(column[first:last].tolist() for column in columns), strict=True)
        for stamp_ns, time_ns, value, lost in samples:
            if self._is_held(time_ns, value, lost != 0):
                self.fired = Firing(stamp_ns, value)
                return

    def _is_held(self, time_ns: int, value: float, is_after_gap: bool) -> bool:
        """Take one sample.

        Return whether the condition has now been true for as long as it has to be.
        """
        is_true = self._is_true(time_ns, value)
        if not is_true:
            self._true_since_ns = None
            if value == value:  # noqa: PLR0124 (NaN: a bad sample tells nothing of the side the signal is on)
                self._is_armed = True
            return False
        if not self._is_armed:
            return False
        if self._true_since_ns is None or is_after_gap:
            self._true_since_ns = time_ns
        return time_ns - self._true_since_ns >= self._hold_ns

    def _is_true(self, time_ns: int, value: float) -> bool:
        if self._trend is None:
            return self._condition.holds(value)
        change = self._trend.change(time_ns, value)
        return change is not None and abs(change) <= (self._condition.settles_within or 0.0)


class _Trend:
    """The straight line through the last `BINS` means of a signal.

    The line is told as its change over their whole time.
    """

    def __init__(self, over_ns: int) -> None:
        self._bin_ns = max(over_ns // BINS, 1)
        self._bin_end_ns: int | None = None
        self._sum, self._count = 0.0, 0
        self._means: list[float] = []
        self._change: float | None = None

    def change(self, time_ns: int, value: float) -> float | None:
        """Take one sample.

        Return the change, or None while the signal has not been seen for long enough.
        """
        if value != value:  # noqa: PLR0124 (NaN: a bad sample)
            return self._change
        if self._bin_end_ns is None:
            self._bin_end_ns = time_ns + self._bin_ns
        if time_ns >= self._bin_end_ns:
            self._close(time_ns)
        self._sum += value
        self._count += 1
        return self._change

    def _close(self, time_ns: int) -> None:
        end_ns = self._bin_end_ns or time_ns
        if time_ns >= end_ns + self._bin_ns:  # a bin without a sample: what was seen before it proves nothing
            self._means.clear()
            end_ns = time_ns
        else:
            self._means = [*self._means[1 - BINS :], self._sum / self._count]
        self._bin_end_ns = end_ns + self._bin_ns
        self._sum, self._count = 0.0, 0
        self._change = _slope(self._means) * BINS if len(self._means) == BINS else None


def _slope(means: list[float]) -> float:
    """Return the least-squares slope of values at 0, 1, 2, ..."""
    middle = (len(means) - 1) / 2.0
    above = below = 0.0
    for index, mean in enumerate(means):
        above += (index - middle) * mean
        below += (index - middle) * (index - middle)
    return above / below
