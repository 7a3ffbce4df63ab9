"""Frames in columns: the one form in which CAN traffic moves.

Traffic moves from a bus or a log to the decoder.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import IntFlag
from typing import Any

import numpy as np
from numpy.typing import NDArray

FD_LENGTHS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)  # payload bytes of DLC 0 to 15
_KEPT = np.where(np.arange(64) < np.arange(65)[:, None], 255, 0).astype(np.uint8).view(np.uint64)  # bytes of a payload


class FrameFlag(IntFlag):
    """What kind of frame it is."""

    EXTENDED = 1
    REMOTE = 2
    ERROR = 4
    FD = 8
    BITRATE_SWITCH = 16
    ERROR_STATE = 32
    SENT = 64  # sent by this side, not received


# Not frozen: a bench in lock-step makes thousands of them a second, and freezing trebles what one costs.
@dataclass(slots=True, eq=False)
class FrameBlock:
    """Frames in columns, in the order in which they were seen.

    `stamp_ns` int64 (n), integer nanoseconds on the clock of the bus; `ident` uint32 (n), the arbitration id; `flags`
    uint8 (n) of `FrameFlag`; `length` uint8 (n), payload bytes; `data` uint8 (n, w), zero behind the payload, w = 8
    or 64; `channel` uint8 (n).
    """

    stamp_ns: NDArray[np.int64]
    ident: NDArray[np.uint32]
    flags: NDArray[np.uint8]
    length: NDArray[np.uint8]
    data: NDArray[np.uint8]
    channel: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.stamp_ns)

    @staticmethod
    def empty(width: int = 8) -> FrameBlock:
        """Return a block without frames."""
        return FrameBlock(
            np.empty(0, np.int64),
            np.empty(0, np.uint32),
            np.empty(0, np.uint8),
            np.empty(0, np.uint8),
            np.empty((0, width), np.uint8),
            np.empty(0, np.uint8),
        )

    def select(self, part: slice | NDArray[np.bool_] | NDArray[np.intp]) -> FrameBlock:
        """Return some of the frames."""
        return FrameBlock(
            self.stamp_ns[part],
            self.ident[part],
            self.flags[part],
            self.length[part],
            self.data[part],
            self.channel[part],
        )


def classic_frames(
    stamp_ns: int, ident: int, payloads: Sequence[bytes], *, extended: bool = False, width: int = 8
) -> FrameBlock:
    """Return classic frames of one identifier at one instant.

    `payloads` have up to 8 bytes, rows are `width` wide.
    """
    count = len(payloads)
    data = np.zeros((count, width), np.uint8)
    for row, payload in enumerate(payloads):
        data[row, : len(payload)] = np.frombuffer(payload, np.uint8)
    return FrameBlock(
        np.full(count, stamp_ns, np.int64),
        np.full(count, ident, np.uint32),
        np.full(count, int(FrameFlag.EXTENDED) if extended else 0, np.uint8),
        np.array([len(payload) for payload in payloads], np.uint8),
        data,
        np.zeros(count, np.uint8),
    )


def clear_behind(data: NDArray[np.uint8], length: NDArray[np.integer[Any]]) -> None:
    """Set what lies behind each payload's length (n) to zero, in place.

    `data` is uint8 (n, 8 or 64), contiguous.
    """
    words = data.view(np.uint64)
    words &= _KEPT[:, : words.shape[1]].take(length, axis=0)


def concatenate_frames(blocks: Iterable[FrameBlock]) -> FrameBlock:
    """Join blocks end to end; the result is as wide as its widest part."""
    parts = [block for block in blocks if len(block.stamp_ns)]
    if not parts:
        return FrameBlock.empty()
    if len(parts) == 1:
        return parts[0]
    payloads = [block.data for block in parts]
    width = max(payload.shape[1] for payload in payloads)
    if all(payload.shape[1] == width for payload in payloads):
        data = np.concatenate(payloads)
    else:
        data = np.zeros((sum(map(len, payloads)), width), np.uint8)
        row = 0
        for payload in payloads:
            data[row : row + len(payload), : payload.shape[1]] = payload
            row += len(payload)
    return FrameBlock(
        np.concatenate([b.stamp_ns for b in parts]),
        np.concatenate([b.ident for b in parts]),
        np.concatenate([b.flags for b in parts]),
        np.concatenate([b.length for b in parts]),
        data,
        np.concatenate([b.channel for b in parts]),
    )


def gathered(blocks: Iterable[FrameBlock], payload_bytes: int = 1 << 18) -> Iterator[FrameBlock]:
    """Yield the same frames in blocks of at least so many bytes of payload.

    Such blocks cost less a frame to work on.

    The last has less. By default a block fits into the processor's cache.
    """
    waiting: list[FrameBlock] = []
    size = 0
    for block in blocks:
        waiting.append(block)
        size += block.data.nbytes
        if size >= payload_bytes:
            yield concatenate_frames(waiting)
            waiting, size = [], 0
    if waiting:
        yield concatenate_frames(waiting)
