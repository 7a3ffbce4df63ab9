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
        self._roles = slow
        self._held = {
            name: _Held([role for role in slow if slow[role] == name], commands) for name in set(slow.values())
        }
        self._commands = [role for role in slow if role in commands]

    def push(self, blocks: Iterable[SampleBlock]) -> SampleBlock | None:
        """Take new samples; return those that are complete, if any."""
        arrived = list(blocks)
        for block in arrived:
            if block.source in self._held and len(block):
                self._held[block.source].push(block)
        samples = self._source.push(arrived)
        if samples is None:
            return None
        columns = dict(samples.columns)
        values: dict[str, Float64] = {}
        ages: dict[str, tuple[Float64, Float64]] = {}
        for held in self._held.values():
            held.fill(samples.stamp_ns, values, ages)
        for role in self._roles:
            columns.setdefault(role, values[role])
        if self._commands:
            newest = np.fmin.reduce([ages[role] for role in self._commands])
            columns |= {name: 1e-9 * age for name, age in zip((COMMAND_AGE, COMMAND_FRAME_AGE), newest, strict=True)}
        return SampleBlock(samples.source, samples.time_ns, samples.stamp_ns, columns, samples.lost_before)


class _Held:
    """The last values of a source's slow signals at or before a stamp."""

    def __init__(self, roles: list[str], commands: Collection[str]) -> None:
        self._stamps: Int64 = np.empty(0, np.int64)
        self._values: dict[str, Float64] = {role: np.empty(0) for role in roles}
        # the stamp of the first value of those that are the same
        self._since: dict[str, Int64] = {role: np.empty(0, np.int64) for role in roles if role in commands}

    def push(self, block: SampleBlock) -> None:
        for role, before in self._since.items():
            values, held = block.columns[role], self._values[role]
            is_new = np.empty(len(values), np.bool_)
            is_new[0] = not len(held) or values[0] != held[-1]
            np.not_equal(values[1:], values[:-1], out=is_new[1:])
            since = np.maximum.accumulate(np.where(is_new, block.stamp_ns, before[-1] if len(before) else 0))
            self._since[role] = np.concatenate([before, since])
        for role, held in self._values.items():
            self._values[role] = np.concatenate([held, block.columns[role]])
        self._stamps = np.concatenate([self._stamps, block.stamp_ns])

    def fill(self, stamp_ns: Int64, values: dict[str, Float64], ages: dict[str, tuple[Float64, Float64]]) -> None:
        """Fill in what each role holds at stamps (n), and the ages of commands.

        The first age is for how many ns a command has been the same, the second how many ns ago it was seen.

        NaN before the first value.
        """
        index = np.searchsorted(self._stamps, stamp_ns, side="right") - 1
        known = index >= 0 if index.min(initial=0) < 0 else slice(None)  # a mask costs more than all else
        index = index[known]
        for role, held in self._values.items():
            values[role] = np.full(len(stamp_ns), np.nan)
            values[role][known] = held[index]
        if self._since:
            seen_ns = np.full(len(stamp_ns), np.nan)
            seen_ns[known] = stamp_ns[known] - self._stamps[index]
        for role, since in self._since.items():
            since_ns = np.full(len(stamp_ns), np.nan)
            since_ns[known] = stamp_ns[known] - since[index]
            ages[role] = since_ns, seen_ns
        keep = int(index.min()) if len(index) == len(stamp_ns) and len(index) else 0
        if keep:
            self._stamps = self._stamps[keep:]
            self._values = {role: held[keep:] for role, held in self._values.items()}
            self._since = {role: since[keep:] for role, since in self._since.items()}
