"""Frames in columns from and to python-can's messages; apart from `frames` because `import can` is slow."""

from __future__ import annotations

from typing import TYPE_CHECKING

import can
import numpy as np

from etb_hil.canio.frames import FrameBlock, FrameFlag

if TYPE_CHECKING:
    from collections.abc import Iterable


def from_messages(messages: Iterable[can.Message], *, sent: bool = False) -> FrameBlock:
    """Return python-can's messages as columns; stamps are rounded to the nanosecond; `sent` flags all as `SENT`."""
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
        np.array([min(max(m.channel, 0), 255) if isinstance(m.channel, int) else 0 for m in items], np.uint8),
    )


def to_message(frames: FrameBlock, row: int) -> can.Message:
    """Return one frame as python-can's message."""
    flags = FrameFlag(int(frames.flags[row]))
    length = int(frames.length[row])
    remote = bool(flags & FrameFlag.REMOTE)
    return can.Message(
        timestamp=int(frames.stamp_ns[row]) * 1e-9,
        arbitration_id=int(frames.ident[row]),
        is_extended_id=bool(flags & FrameFlag.EXTENDED),
        is_remote_frame=remote,
        is_error_frame=bool(flags & FrameFlag.ERROR),
        is_fd=bool(flags & FrameFlag.FD),
        bitrate_switch=bool(flags & FrameFlag.BITRATE_SWITCH),
        error_state_indicator=bool(flags & FrameFlag.ERROR_STATE),
        is_rx=not flags & FrameFlag.SENT,
        dlc=length,
        data=None if remote else frames.data[row, :length].tobytes(),
        channel=int(frames.channel[row]),
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
