"""How long the frames of samples were on the bus, stuff bits included."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.canio.bit_timing import INTERMISSION_BITS, frame_bits
from etb_hil.canio.frames import FrameFlag, concatenate_frames

if TYPE_CHECKING:
    from etb_hil.canio.bus.budget import BusRates
    from etb_hil.canio.dbc.dialect import Dialect
    from etb_hil.canio.dbc.dialect_message import DialectMessage
    from etb_hil.canio.frames import FrameBlock
    from etb_hil.recording.samples import Float64, Int64

_KIND = FrameFlag.EXTENDED | FrameFlag.REMOTE | FrameFlag.ERROR | FrameFlag.SENT


class BusTime:
    """The time from the start of a sample's first frame to the stamp of its last one.

    A frame has its stamp at its end (ISO 11898-1), so that it started by its own length before. Only the frames of two
    segments are kept: samples are asked for in the segment after their frames at the latest.
    """

    def __init__(self, dialect: Dialect, sources: Iterable[str], bus: BusRates) -> None:
        self._messages, self._bus = [dialect.message(source) for source in sources], bus
        self._before: list[FrameBlock] = []
        self._now: list[FrameBlock] = []

    def begin_segment(self, frames: list[FrameBlock]) -> None:
        """Take the frames of a segment in the order of their arrival.

        Those from before the last segment are forgotten.
        """
        self._before, self._now = self._now, frames

    def at(self, stamp_ns: Int64) -> Float64:
        """Return the time on the bus in s of samples.

        The stamps (n) are those of their last frames. The result is NaN where the frames are not known.
        """
        frames = concatenate_frames([*self._before, *self._now])
        return np.max([self._since_start(message, frames, stamp_ns) for message in self._messages], axis=0)

    def _since_start(self, message: DialectMessage, frames: FrameBlock, stamp_ns: Int64) -> Float64:
        """Return how long before stamps (n) the last frames of a message started.

        The result is in s.
        """
        kind = FrameFlag.EXTENDED if message.extended else FrameFlag(0)
        own = frames.select((frames.ident == message.ident) & (frames.flags & _KIND == kind))
        nominal, data = frame_bits(own)
        length = (nominal - INTERMISSION_BITS) / self._bus.bitrate + data / self._bus.data_bitrate
        index = np.searchsorted(own.stamp_ns, stamp_ns, side="right") - 1
        found = np.full(len(stamp_ns), np.nan)
        known = index >= 0
        found[known] = 1e-9 * (stamp_ns[known] - own.stamp_ns[index[known]]) + length[index[known]]
        return found
