"""Frames in columns from and to python-can's messages.

Apart from `frames` because `import can` is slow.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import can
import numpy as np

from etb_hil.canio.frames import FrameBlock, FrameFlag

if TYPE_CHECKING:
    from collections.abc import Iterable

# Plain numbers: an operation on an IntFlag costs as much as all the rest of a message.
_EXTENDED, _REMOTE, _ERROR, _FD = map(int, (FrameFlag.EXTENDED, FrameFlag.REMOTE, FrameFlag.ERROR, FrameFlag.FD))
_BITRATE_SWITCH, _ERROR_STATE, _SENT = map(int, (FrameFlag.BITRATE_SWITCH, FrameFlag.ERROR_STATE, FrameFlag.SENT))


def from_messages(messages: Iterable[can.Message]) -> FrameBlock:
    """Return python-can's messages as columns; stamps are rounded to the nanosecond."""
    items = list(messages)
    width = 64 if any(m.is_fd for m in items) else 8
    data = np.zeros((len(items), width), np.uint8)
    for index, m in enumerate(items):
        if m.data:
            data[index, : len(m.data)] = np.frombuffer(bytes(m.data), np.uint8)
    return FrameBlock(
        np.array([round(m.timestamp * 1e9) for m in items], np.int64),
        np.array([m.arbitration_id for m in items], np.uint32),
        np.array([_flags_of(m) | (0 if m.is_rx else _SENT) for m in items], np.uint8),
        np.array([m.dlc if m.is_remote_frame else len(m.data) for m in items], np.uint8),
        data,
        np.array([min(max(m.channel, 0), 255) if isinstance(m.channel, int) else 0 for m in items], np.uint8),
    )


def to_message(frames: FrameBlock, index: int) -> can.Message:
    """Return one frame as python-can's message."""
    flags = int(frames.flags[index])
    length = int(frames.length[index])
    remote = flags & _REMOTE != 0
    return can.Message(
        timestamp=int(frames.stamp_ns[index]) * 1e-9,
        arbitration_id=int(frames.ident[index]),
        is_extended_id=flags & _EXTENDED != 0,
        is_remote_frame=remote,
        is_error_frame=flags & _ERROR != 0,
        is_fd=flags & _FD != 0,
        bitrate_switch=flags & _BITRATE_SWITCH != 0,
        error_state_indicator=flags & _ERROR_STATE != 0,
        is_rx=flags & _SENT == 0,
        dlc=length,
        data=None if remote else frames.data[index, :length].tobytes(),
        channel=int(frames.channel[index]),
    )


def _flags_of(m: can.Message) -> int:
    return (
        (_EXTENDED if m.is_extended_id else 0)
        | (_REMOTE if m.is_remote_frame else 0)
        | (_ERROR if m.is_error_frame else 0)
        | (_FD if m.is_fd else 0)
        | (_BITRATE_SWITCH if m.bitrate_switch else 0)
        | (_ERROR_STATE if m.error_state_indicator else 0)
    )
