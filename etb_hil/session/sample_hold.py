"""Sample and hold: slow signals at the instants of the fast ones."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Protocol

import numpy as np

from etb_hil.diagnosis.segments import COMMAND_AGE, COMMAND_FRAME_AGE
from etb_hil.recording.samples import Float64, Int64, SampleBlock


class SampleSource(Protocol):
    """A source of joined samples: a `Joiner`, or `InterpolatedReadings`."""

    def push(self, blocks: Iterable[SampleBlock]) -> SampleBlock | None:
        """Take new samples; return those that are complete, if any."""
        ...


class SampleHold:
    """Hold the last value of each slow signal at the samples of the fast ones.

    The result does not depend on how the samples were cut into blocks.
    """

    def __init__(self, source: SampleSource, slow: dict[str, str], commands: Collection[str] = ()) -> None:
        """Take the samples of a `source`.

        `slow` maps roles to the sources that bring them now and then. With some of them as `commands`, the samples have
        the columns `COMMAND_AGE` and `COMMAND_FRAME_AGE`.
        """
        self._source = source
        self._held = {role: _Held(source, role) for role, source in slow.items()}
        self._commands = commands

    def push(self, blocks: Iterable[SampleBlock]) -> SampleBlock | None:
        """Take new samples; return those that are complete, if any."""
        arrived = list(blocks)
        for held in self._held.values():
            held.push(arrived)
        samples = self._source.push(arrived)
        if samples is None:
            return None
        columns, ages = dict(samples.columns), []
        for role, held in self._held.items():
            values, since_ns, seen_ns = held.at(samples.stamp_ns)
            columns.setdefault(role, values)
            if role in self._commands:
                ages.append((since_ns, seen_ns))
        if ages:
            newest = np.fmin.reduce(ages)
            columns |= {name: 1e-9 * age for name, age in zip((COMMAND_AGE, COMMAND_FRAME_AGE), newest, strict=True)}
        return SampleBlock(samples.source, samples.time_ns, samples.stamp_ns, columns, samples.lost_before)


class _Held:
    """The last value of a slow signal at or before a stamp."""

    def __init__(self, source: str, role: str) -> None:
        self._source = source
        self._role = role
        self._stamps: Int64 = np.empty(0, np.int64)
        self._values: Float64 = np.empty(0)
        self._since: Int64 = np.empty(0, np.int64)  # the stamp of the first value of those that are the same

    def push(self, blocks: Iterable[SampleBlock]) -> None:
        for block in blocks:
            if block.source == self._source and len(block):
                values = block.columns[self._role]
                is_new = np.append(not len(self._values) or values[0] != self._values[-1], values[1:] != values[:-1])
                last = self._since[-1] if len(self._since) else 0
                since = np.maximum.accumulate(np.where(is_new, block.stamp_ns, last))
                self._stamps = np.concatenate([self._stamps, block.stamp_ns])
                self._values = np.concatenate([self._values, values])
                self._since = np.concatenate([self._since, since])

    def at(self, stamp_ns: Int64) -> tuple[Float64, Float64, Float64]:
        """Return what is held at stamps (n), and for how long it has been so.

        The second result is for how many ns it has been the same, the third how many ns ago it was seen.

        NaN before the first value.
        """
        index = np.searchsorted(self._stamps, stamp_ns, side="right") - 1
        values, since_ns, seen_ns = (np.full(len(stamp_ns), np.nan) for _ in range(3))
        known = index >= 0
        values[known] = self._values[index[known]]
        since_ns[known] = stamp_ns[known] - self._since[index[known]]
        seen_ns[known] = stamp_ns[known] - self._stamps[index[known]]
        keep = max(int(index.min()), 0) if len(index) else 0
        self._stamps, self._values, self._since = self._stamps[keep:], self._values[keep:], self._since[keep:]
        return values, since_ns, seen_ns
