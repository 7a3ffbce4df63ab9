"""Frames of a log that a log written from it does not hold."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.canio.frames import FrameFlag, concatenate_frames

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from etb_hil.canio.frames import FrameBlock

_FLAGS = {
    FrameFlag.SENT: "direction",
    FrameFlag.EXTENDED: "width of identifiers",
    FrameFlag.REMOTE: "kind",
    FrameFlag.ERROR: "kind",
    FrameFlag.FD: "kind",
    FrameFlag.BITRATE_SWITCH: "bit rate switch",
    FrameFlag.ERROR_STATE: "error state",
}


_MOST_WAITING = 64  # blocks of one stamp that are looked at together


@dataclass(slots=True)
class Losses:
    """`frames` that both logs have.

    The shift of all stamps, as the first frame has it, and the largest rest, in ns.

    `gone` says what else is not as it was, and of how many frames.
    """

    frames: int = 0
    shift_ns: int = 0
    worst_ns: int = 0
    gone: dict[str, int] = field(default_factory=dict)

    def __str__(self) -> str:
        gone = [f"{what} of {count} frames not kept" for what, count in self.gone.items()]
        if not self.shift_ns and not self.worst_ns:
            return ", ".join([*gone, "stamps kept to the nanosecond"])
        shift = f"stamps shifted by {self.shift_ns * 1e-9:.9f} s, " if self.shift_ns else "stamps "
        return ", ".join([*gone, f"{shift}rounded by at most {self.worst_ns} ns"])


def by_kind(blocks: Iterable[FrameBlock]) -> Iterator[FrameBlock]:
    """Yield the frames with those of equal stamp in one order.

    Data frames come first, then error frames, then remote frames.

    MF4 keeps a group for each of these kinds, and thereby no order between them.
    """
    waiting: list[FrameBlock] = []
    for block in blocks:
        waiting.append(block)
        last = np.searchsorted(block.stamp_ns, block.stamp_ns[-1])
        if last or len(waiting) == _MOST_WAITING:
            joined = concatenate_frames(waiting)
            cut = len(joined) - (len(block) - int(last)) if last else len(joined)
            yield _sorted_by_kind(joined.select(slice(cut)))
            waiting = [joined.select(slice(cut, None))] if cut < len(joined) else []
    if waiting:
        yield _sorted_by_kind(concatenate_frames(waiting))


def _sorted_by_kind(frames: FrameBlock) -> FrameBlock:
    error = (frames.flags & FrameFlag.ERROR) != 0
    kind = np.where(error, 1, np.where((frames.flags & FrameFlag.REMOTE) != 0, 2, 0))
    return frames.select(np.lexsort((kind, frames.stamp_ns))) if kind.any() else frames


def losses(before: Iterable[FrameBlock], after: Iterable[FrameBlock]) -> Losses:
    """Compare two logs frame by frame, in their order."""
    found = Losses()
    for old, new in _side_by_side(iter(before), iter(after)):
        moved = new.stamp_ns - old.stamp_ns
        if not found.frames:
            found.shift_ns = int(moved[0])
        found.worst_ns = max(found.worst_ns, int(np.max(np.abs(moved - found.shift_ns))))
        found.frames += len(new)
        for what, differs in _differences(old, new):
            if count := int(np.count_nonzero(differs)):
                found.gone[what] = found.gone.get(what, 0) + count
    return found


def _differences(old: FrameBlock, new: FrameBlock) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    flags = old.flags ^ new.flags
    for flag, what in _FLAGS.items():
        yield what, (flags & flag) != 0
    remote = (old.flags & FrameFlag.REMOTE) != 0
    error = (old.flags & FrameFlag.ERROR) != 0
    length, ident = old.length != new.length, old.ident != new.ident
    width = min(old.data.shape[1], new.data.shape[1])
    payload = (old.data[:, :width] != new.data[:, :width]).any(axis=1)
    payload |= old.data[:, width:].any(axis=1) | new.data[:, width:].any(axis=1)
    yield "channel", old.channel != new.channel
    yield "length of remote frames", length & remote
    yield "what error frames carry", (length | ident | payload) & error
    rest = ~error
    yield "identifier", ident & rest
    yield "payload", (payload | length & ~remote) & rest


def _side_by_side(first: Iterator[FrameBlock], second: Iterator[FrameBlock]) -> Iterator[tuple[FrameBlock, FrameBlock]]:
    """Yield the same rows of two streams that are cut in different places."""
    one, two = next(first, None), next(second, None)
    while one is not None and two is not None:
        count = min(len(one), len(two))
        if count:
            yield one.select(slice(count)), two.select(slice(count))
        one = one.select(slice(count, None)) if len(one) > count else next(first, None)
        two = two.select(slice(count, None)) if len(two) > count else next(second, None)
