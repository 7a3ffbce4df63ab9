"""A log that a plug-in reads, whose faults are said.

What its reader raises or yields wrong costs nothing that came before.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from etb_hil.base.errors import InputError, Place
from etb_hil.base.plugins import Part
from etb_hil.base.userfile import require_file
from etb_hil.canio.frames import FrameBlock
from etb_hil.canio.logs.log_reader import LogReader, Reader


class GuardedLog:
    """A log file read by a plug-in."""

    def __init__(self, part: Part, path: Path) -> None:
        self.path, self._part = path, part
        require_file(path)
        reader: Reader = part.value
        with part.guarded(f"opening {path}"):
            self._log: LogReader = reader.open(path)
        self.notes: list[str] = []
        self.begin_ns = self._log.begin_ns

    def __iter__(self) -> Iterator[FrameBlock]:
        """Yield the frames; InputError where not even the first block can be read."""
        self.notes = []
        frames = 0
        try:
            with self._part.guarded(f"reading {self.path}"):
                for block in self._log:
                    _require_whole(block)
                    self.begin_ns = self._log.begin_ns  # which readers know with the first block
                    yield block
                    frames += len(block)
                self.notes += self._log.notes
        except InputError as error:
            if not frames:
                raise
            self.notes += [*self._log.notes, f"{Place(self.path, frame=frames)}: {error}"]


def _require_whole(block: FrameBlock) -> None:
    if not isinstance(block, FrameBlock):
        raise TypeError(f"it yielded {type(block).__name__} in place of FrameBlock")
    lengths = {len(getattr(block, name)) for name in ("stamp_ns", "ident", "flags", "length", "data", "channel")}
    if len(lengths) != 1:
        raise ValueError(f"the columns of a FrameBlock have {', '.join(map(str, sorted(lengths)))} entries")
    if block.data.ndim != 2 or block.data.shape[1] not in {8, 64}:
        raise ValueError(f"`data` must have 8 or 64 columns (its shape is {block.data.shape})")
