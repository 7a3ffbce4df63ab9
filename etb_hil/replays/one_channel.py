"""Refuse two units in one log: one message on two channels is not one unit's."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.canio.frames import FrameFlag
from etb_hil.replays.log_frames import channels_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from etb_hil.canio.dbc.dialect import Dialect
    from etb_hil.canio.frames import FrameBlock

_KIND = FrameFlag.EXTENDED | FrameFlag.REMOTE | FrameFlag.ERROR


def one_channel_each(frames: Iterable[FrameBlock], dialect: Dialect, path: Path) -> Iterator[FrameBlock]:
    """Yield the frames of a log.

    InputError where a message with roles comes on more than one channel.
    """
    seen: dict[str, set[int]] = {message.name: set() for message in dialect.messages}
    for block in frames:
        kind = block.flags & _KIND
        for message in dialect.messages:
            is_its = (block.ident == message.ident) & (kind == (FrameFlag.EXTENDED if message.extended else 0))
            channels = seen[message.name]
            channels |= channels_of(block.channel[is_its])
            if len(channels) > 1:
                there = sorted(channels)
                raise InputError(
                    Problem(
                        f"{message.name} comes on channels {' and '.join(map(str, there))}: more than one unit",
                        Place(path),
                        remedy=f"judge one, or each with {' '.join(f'--channel {channel}' for channel in there)}",
                    )
                )
        yield block
