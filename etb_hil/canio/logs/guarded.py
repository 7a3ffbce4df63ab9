"""A log that a plug-in reads, whose faults are said.

What its reader raises or yields wrong costs nothing that came before.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.errors import InputError, Place
from etb_hil.base.plugins import Part
from etb_hil.base.userfile import require_file
from etb_hil.canio.frames import FrameBlock
from etb_hil.canio.logs.log_reader import LogReader, Reader

Whole = TypeVar("Whole", bound=np.integer)


class GuardedLog:
    """A log file read by a plug-in."""

    def __init__(self, part: Part, path: Path) -> None:
        self.path, self._part = path, part
        require_file(path)
        reader: Reader = part.value
        with part.guarded(f"opening {path}"):
            self._log: LogReader = reader.open(path)
            self.begin_ns = _whole_or_none(self._log.begin_ns)
        self.notes: list[str] = []

    def __iter__(self) -> Iterator[FrameBlock]:
        """Yield the frames; InputError where not even the first block can be read."""
        self.notes = []
        frames = 0
        try:
            with self._part.guarded(f"reading {self.path}"):
                for block in self._log:
                    whole = _whole(block)
                    self.begin_ns = _whole_or_none(self._log.begin_ns)  # which readers know with the first block
                    yield whole
                    frames += len(whole)
                self.notes += map(str, self._log.notes)
        except InputError as error:
            if not frames:
                raise
            with suppress(InputError), self._part.guarded("its notes"):
                self.notes += map(str, self._log.notes)
            self.notes.append(f"{Place(self.path, frame=frames)}: {error}")


def _whole(block: FrameBlock) -> FrameBlock:
    """Return a block with columns of our types.

    TypeError or ValueError where they do not fit.
    """
    if not isinstance(block, FrameBlock):
        raise TypeError(f"it yielded {type(block).__name__} in place of FrameBlock")
    whole = FrameBlock(
        _column("stamp_ns", block.stamp_ns, np.int64),
        _column("ident", block.ident, np.uint32),
        _column("flags", block.flags, np.uint8),
        _column("length", block.length, np.uint8),
        _column("data", block.data, np.uint8),
        _column("channel", block.channel, np.uint8),
    )
    lengths = {len(getattr(whole, name)) for name in ("stamp_ns", "ident", "flags", "length", "data", "channel")}
    if len(lengths) != 1:
        raise ValueError(f"the columns of a FrameBlock have {', '.join(map(str, sorted(lengths)))} entries")
    if whole.data.shape[1] not in {8, 64}:
        raise ValueError(f"`data` must have 8 or 64 columns (its shape is {whole.data.shape})")
    return whole


def _column(name: str, given: object, kind: type[Whole]) -> NDArray[Whole]:
    column = np.asarray(given)
    dimensions = 2 if name == "data" else 1
    if column.ndim != dimensions:
        raise ValueError(f"`{name}` must have {dimensions} dimensions (its shape is {column.shape})")
    if column.dtype == kind:
        return column.copy()  # a reader may fill the same array for each block
    limits = np.iinfo(kind)
    if column.size and (column.dtype.kind not in "iu" or column.min() < limits.min or column.max() > limits.max):
        raise TypeError(f"`{name}` must hold whole numbers from {limits.min} to {limits.max} (it has {column.dtype})")
    return column.astype(kind)


def _whole_or_none(begin_ns: int | None) -> int | None:
    return None if begin_ns is None else operator.index(begin_ns)
