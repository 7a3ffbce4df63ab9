"""From samples of several messages to rows on one clock, as the diagnosis reads them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

import numpy as np

from etb_hil.recording.samples import Float64, Int64, SampleBlock


class RowSource(Protocol):
    """What makes rows of samples while they arrive: a `Joiner`, or `ReadingRows`."""

    def push(self, blocks: Iterable[SampleBlock]) -> SampleBlock | None:
        """Take new samples; return the rows that became whole, if any."""
        ...


class RowBuilder:
    """Holds the slow signals beside rows of the fast ones.

    The rows do not depend on how the samples were cut into blocks.
    """

    def __init__(self, rows: RowSource, slow: dict[str, str]) -> None:
        """Take the rows of `rows`.

        `slow` maps roles to the sources that bring them now and then.
        """
        self._source = rows
        self._held = {role: _Held(source, role) for role, source in slow.items()}

    def push(self, blocks: Iterable[SampleBlock]) -> SampleBlock | None:
        """Take new samples; return the rows that became whole, if any."""
        arrived = list(blocks)
        for held in self._held.values():
            held.push(arrived)
        rows = self._source.push(arrived)
        if rows is None:
            return None
        columns = dict(rows.columns)
        for role, held in self._held.items():
            columns.setdefault(role, held.at(rows.stamp_ns))
        return SampleBlock(rows.source, rows.time_ns, rows.stamp_ns, columns, rows.lost_before)


class _Held:
    """The last value of a slow signal at or before a stamp."""

    def __init__(self, source: str, role: str) -> None:
        self._source = source
        self._role = role
        self._stamps: Int64 = np.empty(0, np.int64)
        self._values: Float64 = np.empty(0)

    def push(self, blocks: Iterable[SampleBlock]) -> None:
        for block in blocks:
            if block.source == self._source:
                self._stamps = np.concatenate([self._stamps, block.stamp_ns])
                self._values = np.concatenate([self._values, block.columns[self._role]])

    def at(self, stamp_ns: Int64) -> Float64:
        index = np.searchsorted(self._stamps, stamp_ns, side="right") - 1
        values = np.full(len(stamp_ns), np.nan)
        known = index >= 0
        values[known] = self._values[index[known]]
        keep = max(int(index.min()), 0) if len(index) else 0
        self._stamps, self._values = self._stamps[keep:], self._values[keep:]
        return values
