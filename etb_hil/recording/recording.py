"""A Recording: what was measured, with its gaps, its clock and where it came from."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.roles import ROLES
from etb_hil.recording.samples import Float64, Int64, Joiner, SampleBlock, concatenate


class ClockGrade(StrEnum):
    """How good the time of the samples is."""

    SAMPLE_COUNTER = "sample counter"
    RECEIVE_STAMPS = "receive stamps"
    TABLE = "time column of a table"


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """One role over time.

    `time_ns` (n) is on the sample clock; `values` (n) are in the role's SI unit, NaN where bad.
    """

    role: str
    unit: str
    time_ns: Int64
    values: Float64


@dataclass(frozen=True, slots=True)
class Gap:
    """Samples that are missing between two instants of one source.

    `lost` says how many, None where nothing counts them.
    """

    source: str
    start_ns: int
    end_ns: int
    lost: int | None


@dataclass(slots=True, eq=False)
class Recording:
    """Signals in SI units on the controller's sample clock.

    Grows by `append`, is read by role.

    `notes` says in words what of the source could not be read or was left out.
    """

    origin: str
    clock: ClockGrade
    notes: list[str] = field(default_factory=list)
    _blocks: dict[str, list[SampleBlock]] = field(default_factory=dict)

    def append(self, blocks: Iterable[SampleBlock]) -> None:
        """Add blocks of samples, in the order in which they were received."""
        for block in blocks:
            if len(block):
                self._blocks.setdefault(block.source, []).append(block)

    @property
    def sources(self) -> list[str]:
        """Names of the sources that have delivered samples."""
        return list(self._blocks)

    @property
    def roles(self) -> list[str]:
        """Roles that have samples."""
        return list(dict.fromkeys(role for parts in self._blocks.values() for role in parts[0].columns))

    def block(self, source: str) -> SampleBlock:
        """Return all samples of one source; raises KeyError where it has none."""
        parts = self._blocks[source]
        if len(parts) > 1:
            self._blocks[source] = parts = [concatenate(parts)]
        return parts[0]

    def series(self, role: str) -> Series:
        """Return one role over time; InputError names the roles that are there."""
        for source, parts in self._blocks.items():
            if role in parts[0].columns:
                block = self.block(source)
                return Series(role, ROLES[role].unit, block.time_ns, block.columns[role])
        raise InputError(Problem(f"{self.origin} has no signal for the role '{role}'", allowed=", ".join(self.roles)))

    def joined(self, roles: Iterable[str]) -> SampleBlock:
        """Return the instants at which all of the roles were sampled, with their values."""
        wanted = list(roles)
        sources = list(dict.fromkeys(self.source_of(role) for role in wanted))
        samples = Joiner(sources).push(self.block(source) for source in sources)
        if samples is None:
            empty = np.empty(0, np.int64)
            return SampleBlock("joined", empty, empty, {role: np.empty(0) for role in wanted}, empty)
        columns = {role: samples.columns[role] for role in wanted}
        return SampleBlock("joined", samples.time_ns, samples.stamp_ns, columns, samples.lost_before)

    def gaps(self) -> list[Gap]:
        """Return where samples are missing, in the order of the sources and of time."""
        found = []
        for source in self._blocks:
            block = self.block(source)
            for index in np.flatnonzero(block.lost_before):
                start = int(block.time_ns[index - 1]) if index else int(block.time_ns[0])
                lost = int(block.lost_before[index])
                found.append(Gap(source, start, int(block.time_ns[index]), lost if lost > 0 else None))
        return found

    def source_of(self, role: str) -> str:
        """Return the source that delivers a role.

        InputError names the roles that are there.
        """
        for source, parts in self._blocks.items():
            if role in parts[0].columns:
                return source
        raise InputError(Problem(f"{self.origin} has no signal for the role '{role}'", allowed=", ".join(self.roles)))
