"""The frames of a log to be judged.

Several files are one recording; a channel and a window of it may be chosen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.canio.logs.reading import read_log
from etb_hil.replays.window import within

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from etb_hil.canio.frames import FrameBlock
    from etb_hil.canio.logs.log_reader import LogReader
    from etb_hil.replays.window import Window

_DATE_STEP_NS = 1_000_000  # dates in headers are rounded down to a millisecond


class Frames:
    """The frames of several files, one after the other, read anew by each iteration.

    With a `channel`, counted from 0, those of all others are left out; a `window` counts from the first frame of any
    channel. Afterwards, `notes` says what could not be read, `start_ns` is the first stamp, `channels` are those whose
    frames were given.
    """

    def __init__(self, paths: Sequence[Path], channel: int | None = None, window: Window | None = None) -> None:
        self._paths = paths
        self._channel = channel
        self._window = window
        self.notes: list[str] = []
        self.start_ns: int | None = None
        self.channels: set[int] = set()

    def __iter__(self) -> Iterator[FrameBlock]:
        """Yield the blocks.

        InputError where a file starts before the one in front of it ended, and without frames.
        """
        self.notes, self.start_ns, self.channels = [], None, set()
        others: set[int] = set()
        for block in within(self._joined(), self._window, self._paths[0]):
            frames = block if self._channel is None else block.select(block.channel == self._channel)
            if not len(frames):
                others |= channels_of(block.channel)
                continue
            self.channels |= channels_of(frames.channel)
            yield frames
        if not self.channels and others:
            raise InputError(
                Problem(
                    "holds no frame on the channel",
                    Place(self._paths[0]),
                    self._channel,
                    allowed=", ".join(map(str, sorted(others))),
                )
            )

    def _joined(self) -> Iterator[FrameBlock]:
        last_ns: int | None = None
        for path in self._paths:
            log = read_log(path)
            later_ns: int | None = None
            for block in log:
                if later_ns is None:
                    later_ns = self._later_ns(path, log, int(block.stamp_ns[0]), last_ns)
                if later_ns:
                    block.stamp_ns = block.stamp_ns + later_ns
                if self.start_ns is None:
                    self.start_ns = int(block.stamp_ns[0])
                newest_ns = int(block.stamp_ns.max())
                last_ns = newest_ns if last_ns is None else max(last_ns, newest_ns)
                yield block
            self.notes += log.notes
            if later_ns is None and len(self._paths) > 1:
                self.notes.append(f"{path}: holds no frame")

    def _later_ns(self, path: Path, log: LogReader, first_ns: int, last_ns: int | None) -> int:
        """Return what makes a file's stamps follow those of the file before it.

        The offset is added to them, in ns.
        """
        if len(self._paths) == 1:
            return 0
        if log.begin_ns is None:
            what = "its stamps count from 0 and its header has no date, so that nothing says when this part began"
            raise InputError(Problem(what, Place(path), remedy="record or convert the parts as BLF or candump"))
        later_ns = log.begin_ns
        if last_ns is None or first_ns + later_ns >= last_ns:
            return later_ns
        if later_ns and first_ns + later_ns >= last_ns - _DATE_STEP_NS:
            return last_ns - first_ns
        raise InputError(
            Problem(
                "starts before the file in front of it ends",
                Place(path),
                remedy="give the parts of one recording in the order of time; stamps that start anew in each part, "
                "without a date, tell no order",
            )
        )


def channels_of(channel: NDArray[np.uint8]) -> set[int]:
    """Return the different channels in a column (n)."""
    if not len(channel):
        return set()
    low, high = int(channel.min()), int(channel.max())
    return {low} if low == high else set(np.unique(channel).tolist())
