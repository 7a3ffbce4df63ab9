"""Segments of samples, as they come off a bus or a file, and joined ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Int64 = NDArray[np.int64]
Float64 = NDArray[np.float64]
Bools = NDArray[np.bool_]

LOSS_UNKNOWN = -1


# Not frozen: a bench in lock-step makes thousands of them a second, and freezing trebles what one costs.
@dataclass(slots=True, eq=False)
class SampleBlock:
    """Samples of some roles that one source took at the same instants.

    A source is one message of the bus.

    `time_ns` (n) is on the controller's sample clock, strictly increasing within a source; `stamp_ns` (n) is when the
    frame with the sample was received; `columns` maps roles to values (n) in SI units, NaN where a sample is bad;
    `lost_before` (n) counts the samples missing right before each one, `LOSS_UNKNOWN` where nothing can count them.
    """

    source: str
    time_ns: Int64
    stamp_ns: Int64
    columns: Mapping[str, Float64]
    lost_before: Int64

    def __len__(self) -> int:
        return len(self.time_ns)

    def select(self, part: slice | NDArray[np.bool_ | np.signedinteger]) -> SampleBlock:
        """Return some of the samples."""
        return SampleBlock(
            self.source,
            self.time_ns[part],
            self.stamp_ns[part],
            {role: values[part] for role, values in self.columns.items()},
            self.lost_before[part],
        )


def concatenate(blocks: Iterable[SampleBlock]) -> SampleBlock:
    """Join blocks of one source and the same roles end to end.

    Raises ValueError without any block.
    """
    parts = list(blocks)
    if len(parts) == 1:
        return parts[0]
    first = parts[0] if parts else None
    if first is None:
        raise ValueError("there is no block to join")
    return SampleBlock(
        first.source,
        np.concatenate([b.time_ns for b in parts]),
        np.concatenate([b.stamp_ns for b in parts]),
        {role: np.concatenate([b.columns[role] for b in parts]) for role in first.columns},
        np.concatenate([b.lost_before for b in parts]),
    )


class Joiner:
    """Join samples that several sources took at the same instants, as they arrive.

    A joined sample is complete once every source has delivered its sample of that instant. An instant that one source
    lacks is dropped, and counts as lost before the next. The result does not depend on how the samples were cut into
    blocks. A column that several sources carry is taken from the first of `sources` that has it.
    """

    def __init__(self, sources: Iterable[str], name: str = "joined") -> None:
        self._pending: dict[str, list[SampleBlock]] = {source: [] for source in sources}
        self._name = name
        self._missing = dict.fromkeys(self._pending, 0)  # since the last one, `LOSS_UNKNOWN` where nothing counts them
        if not self._pending:
            raise ValueError("a join needs at least one source")

    def push(self, blocks: Iterable[SampleBlock]) -> SampleBlock | None:
        """Take new blocks (those of other sources are left alone).

        Return the joined samples that are complete, if any.
        """
        for block in blocks:
            if block.source in self._pending and len(block):
                self._pending[block.source].append(block)
        if not all(self._pending.values()):
            return None
        heads = {source: concatenate(parts) for source, parts in self._pending.items()}
        ready_until = min(block.time_ns[-1] for block in heads.values())
        ready, rest = {}, {}
        for source, block in heads.items():
            cut = int(np.searchsorted(block.time_ns, ready_until, side="right"))
            ready[source] = block.select(slice(0, cut))
            rest[source] = block.select(slice(cut, None))
        self._pending = {source: [block] if len(block) else [] for source, block in rest.items()}
        return self._match(ready)

    def _match(self, ready: dict[str, SampleBlock]) -> SampleBlock | None:
        blocks = list(ready.values())
        common = blocks[0].time_ns
        for block in blocks[1:]:
            if len(common) != len(block) or not np.array_equal(common, block.time_ns):
                common = np.intersect1d(common, block.time_ns, assume_unique=True)
        lost = _most([self._lost_before(source, block, common) for source, block in ready.items()])
        if not len(common):
            return None
        picked = [b if len(b) == len(common) else b.select(np.searchsorted(b.time_ns, common)) for b in blocks]
        columns = {role: values for block in reversed(picked) for role, values in block.columns.items()}
        stamp_ns = picked[0].stamp_ns
        for block in picked[1:]:
            stamp_ns = np.maximum(stamp_ns, block.stamp_ns)
        return SampleBlock(self._name, common, stamp_ns, columns, lost)

    def _lost_before(self, source: str, block: SampleBlock, common: Int64) -> Int64:
        """Return how many samples one source misses right before each common instant.

        The result counts what the source lost itself, and what was dropped.
        """
        if len(block) == len(common) and not self._missing[source]:
            return block.lost_before
        group = np.searchsorted(common, block.time_ns)  # the common instant of each sample, or the next one
        known = block.lost_before != LOSS_UNKNOWN
        dropped = np.ones(len(block), np.int64)
        dropped[np.searchsorted(block.time_ns, common)] = 0
        missing = np.bincount(group, np.where(known, block.lost_before, 0) + dropped, len(common) + 1).astype(np.int64)
        unknown = np.bincount(group, ~known, len(common) + 1) > 0
        if self._missing[source] == LOSS_UNKNOWN:
            unknown[0] = True
        else:
            missing[0] += self._missing[source]
        missing[unknown] = LOSS_UNKNOWN
        self._missing[source] = int(missing[-1])
        return missing[:-1]


def _most(losses: list[Int64]) -> Int64:
    """Return the largest loss of several sources, unknown where one of them is."""
    most = losses[0]
    for lost in losses[1:]:
        most = np.where((most == LOSS_UNKNOWN) | (lost == LOSS_UNKNOWN), LOSS_UNKNOWN, np.maximum(most, lost))
    return most
