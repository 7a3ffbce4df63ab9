"""Interpolation of readings, for a controller that is asked for current or angle.

Readings are few; between two of them values are interpolated linearly.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.canio.requested_values import MISSED
from etb_hil.recording.samples import LOSS_UNKNOWN, Float64, Int64, Joiner, SampleBlock, concatenate

if TYPE_CHECKING:
    from etb_hil.canio.data_identifiers import DataIdentifier

GRID_NS = 1_000_000  # between samples where no cyclic frame gives their times


class InterpolatedReadings:
    """Interpolate readings at the samples of cyclic frames.

    Where no signal is cyclic, there is a sample every millisecond. Where readings are missing, there are no samples. Of
    the readings, every `stride`-th is used. The result does not depend on how the samples were cut into blocks.
    """

    def __init__(self, cyclic: list[str], requested: Iterable[DataIdentifier], stride: int = 1) -> None:
        """Take the joined samples of the sources `cyclic`, and the `requested` values."""
        self._joiner = Joiner(cyclic) if cyclic else None
        self._lines = [_Line(one, stride) for one in requested]
        self._pending: SampleBlock | None = None
        self._grid_ns: int | None = None
        self._dropped = 0

    def push(self, blocks: Iterable[SampleBlock]) -> SampleBlock | None:
        """Take new samples; return those that are complete, if any."""
        arrived = list(blocks)
        for line in self._lines:
            line.push(arrived)
        newest_ns = min(line.newest_ns for line in self._lines)
        samples = self._grid(newest_ns) if self._joiner is None else self._joiner.push(arrived)
        waiting = [part for part in (self._pending, samples) if part is not None and len(part)]
        if not waiting:
            return None
        pending = concatenate(waiting)
        late = np.flatnonzero(pending.stamp_ns > newest_ns)
        cut = int(late[0]) if len(late) else len(pending)
        self._pending = pending.select(slice(cut, None))
        return self._whole(pending.select(slice(0, cut))) if cut else None

    def _grid(self, newest_ns: int) -> SampleBlock | None:
        if self._grid_ns is None:
            if newest_ns < 0:
                return None
            self._grid_ns = max(line.first_ns for line in self._lines)
        stamps = np.arange(self._grid_ns, newest_ns + 1, GRID_NS, dtype=np.int64)
        if len(stamps):
            self._grid_ns = int(stamps[-1]) + GRID_NS
        return SampleBlock("readings", stamps, stamps, {}, np.zeros(len(stamps), np.int64))

    def _whole(self, samples: SampleBlock) -> SampleBlock | None:
        columns: dict[str, Float64] = dict(samples.columns)
        known = np.ones(len(samples), np.bool_)
        for line in self._lines:
            columns[line.role], there = line.at(samples.stamp_ns)
            known &= there
        lost = samples.lost_before.copy()
        kept = np.flatnonzero(known)
        before = np.diff(kept, prepend=-1) - 1  # samples dropped right before each one that is kept
        dropped = before.astype(np.int64)
        if len(kept):
            dropped[0] += self._dropped
            self._dropped = len(samples) - 1 - int(kept[-1])
        else:
            self._dropped += len(samples)
            return None
        whole = SampleBlock("joined", samples.time_ns, samples.stamp_ns, columns, lost).select(kept)
        whole.lost_before = np.where(whole.lost_before == LOSS_UNKNOWN, LOSS_UNKNOWN, whole.lost_before + dropped)
        return whole


class _Line:
    """The readings of one role that samples may still need."""

    def __init__(self, requested: DataIdentifier, stride: int) -> None:
        self.role = requested.role
        self.newest_ns = self.first_ns = -1
        self._source, self._stride = requested.source, stride
        self._longest_ns = MISSED * stride * requested.every_ns
        self._count = 0
        self._time_ns: Int64 = np.empty(0, np.int64)
        self._values: Float64 = np.empty(0)

    def push(self, blocks: list[SampleBlock]) -> None:
        for block in blocks:
            if block.source != self._source:
                continue
            taken = slice(-self._count % self._stride, None, self._stride)
            self._count += len(block)
            self._time_ns = np.concatenate([self._time_ns, block.time_ns[taken]])
            self._values = np.concatenate([self._values, block.columns[self.role][taken]])
        if len(self._time_ns):
            self.newest_ns = int(self._time_ns[-1])
            self.first_ns = int(self._time_ns[0]) if self.first_ns < 0 else self.first_ns

    def at(self, stamp_ns: Int64) -> tuple[Float64, np.ndarray]:
        """Return values (n) interpolated between the readings around each stamp.

        The second result (n) is whether both readings are near.
        """
        after = np.clip(np.searchsorted(self._time_ns, stamp_ns, side="left"), 1, max(len(self._time_ns) - 1, 1))
        if len(self._time_ns) < 2:
            return np.full(len(stamp_ns), np.nan), np.zeros(len(stamp_ns), np.bool_)
        begin, end = self._time_ns[after - 1], self._time_ns[after]
        share = (stamp_ns - begin) / (end - begin)
        values = self._values[after - 1] + share * (self._values[after] - self._values[after - 1])
        known = (stamp_ns >= begin) & (stamp_ns <= end) & (end - begin <= self._longest_ns)
        first = max(int(after.min()) - 1, 0)
        self._time_ns, self._values = self._time_ns[first:], self._values[first:]
        return values, known


def at_readings(samples: SampleBlock, times_ns: Mapping[str, list[int]], roles: Iterable[str]) -> SampleBlock:
    """Return the first sample at or after each reading of the first role.

    Its values are measured, not interpolated.
    """
    times = np.array(times_ns[next(iter(roles))], np.int64)
    index = np.searchsorted(times, samples.stamp_ns, side="right")
    return samples.select(np.diff(index, prepend=index[:1] - 1) > 0)
