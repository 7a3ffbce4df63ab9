"""Frames in columns: the one form in which CAN traffic moves, from a bus or a log, to the decoder."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntFlag

import can
import numpy as np
from numpy.typing import NDArray


class FrameFlag(IntFlag):
    """What kind of frame it is."""

    EXTENDED = 1
    REMOTE = 2
    ERROR = 4
    FD = 8
    BITRATE_SWITCH = 16
    ERROR_STATE = 32
    SENT = 64  # sent by this side, not received


@dataclass(frozen=True, slots=True)
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

    def rows(self, part: slice | NDArray[np.bool_] | NDArray[np.intp]) -> FrameBlock:
        """Return some of the frames."""
        return FrameBlock(
            self.stamp_ns[part],
            self.ident[part],
            self.flags[part],
            self.length[part],
            self.data[part],
            self.channel[part],
        )

    @staticmethod
    def from_messages(messages: Iterable[can.Message], *, sent: bool = False) -> FrameBlock:
        """Return python-can's messages as columns; stamps are rounded to the nanosecond."""
        items = list(messages)
        width = 64 if any(m.is_fd for m in items) else 8
        data = np.zeros((len(items), width), np.uint8)
        for row, m in enumerate(items):
            if m.data:
                data[row, : len(m.data)] = np.frombuffer(bytes(m.data), np.uint8)
        return FrameBlock(
            np.array([round(m.timestamp * 1e9) for m in items], np.int64),
            np.array([m.arbitration_id for m in items], np.uint32),
            np.array([_flags_of(m) | (FrameFlag.SENT if sent or not m.is_rx else 0) for m in items], np.uint8),
            np.array([m.dlc if m.is_remote_frame else len(m.data) for m in items], np.uint8),
            data,
            np.array([m.channel if isinstance(m.channel, int) else 0 for m in items], np.uint8),
        )

    def message(self, row: int) -> can.Message:
        """Return one frame as python-can's message."""
        flags = FrameFlag(int(self.flags[row]))
        length = int(self.length[row])
        remote = bool(flags & FrameFlag.REMOTE)
        return can.Message(
            timestamp=int(self.stamp_ns[row]) * 1e-9,
            arbitration_id=int(self.ident[row]),
            is_extended_id=bool(flags & FrameFlag.EXTENDED),
            is_remote_frame=remote,
            is_error_frame=bool(flags & FrameFlag.ERROR),
            is_fd=bool(flags & FrameFlag.FD),
            bitrate_switch=bool(flags & FrameFlag.BITRATE_SWITCH),
            error_state_indicator=bool(flags & FrameFlag.ERROR_STATE),
            is_rx=not flags & FrameFlag.SENT,
            dlc=length,
            data=None if remote else self.data[row, :length].tobytes(),
            channel=int(self.channel[row]),
        )


def concatenate_frames(blocks: Iterable[FrameBlock]) -> FrameBlock:
    """Join blocks end to end; the result is as wide as its widest part."""
    parts = [block for block in blocks if len(block)]
    if not parts:
        return FrameBlock.empty()
    if len(parts) == 1:
        return parts[0]
    width = max(block.data.shape[1] for block in parts)
    data = np.zeros((sum(map(len, parts)), width), np.uint8)
    row = 0
    for block in parts:
        data[row : row + len(block), : block.data.shape[1]] = block.data
        row += len(block)
    return FrameBlock(
        np.concatenate([b.stamp_ns for b in parts]),
        np.concatenate([b.ident for b in parts]),
        np.concatenate([b.flags for b in parts]),
        np.concatenate([b.length for b in parts]),
        data,
        np.concatenate([b.channel for b in parts]),
    )


def _flags_of(m: can.Message) -> int:
    return (
        (FrameFlag.EXTENDED if m.is_extended_id else 0)
        | (FrameFlag.REMOTE if m.is_remote_frame else 0)
        | (FrameFlag.ERROR if m.is_error_frame else 0)
        | (FrameFlag.FD if m.is_fd else 0)
        | (FrameFlag.BITRATE_SWITCH if m.bitrate_switch else 0)
        | (FrameFlag.ERROR_STATE if m.error_state_indicator else 0)
    )
