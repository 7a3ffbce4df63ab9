"""Faults that are injected into a bus.

Put a fault into `VirtualNetwork.faults` and it strikes inside its window.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.canio.dbc.protection import alive_counter, protect
from etb_hil.canio.frames import concatenate_frames

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from etb_hil.canio.dbc.dialect import Dialect
    from etb_hil.canio.dbc.protection import Protection
    from etb_hil.canio.frames import FrameBlock


@dataclass(frozen=True, slots=True)
class Window:
    """When and whom a fault strikes.

    Frames that start in [`from_ns`, `until_ns`) with one of `idents` (None: all).
    """

    from_ns: int
    until_ns: int
    idents: frozenset[int] | None = None

    def holds(self, frame: FrameBlock, start_ns: int) -> bool:
        """Return whether a frame (a block of one row) that starts at `start_ns` is struck."""
        return self.from_ns <= start_ns < self.until_ns and (self.idents is None or int(frame.ident[0]) in self.idents)


@dataclass(frozen=True, slots=True)
class Fault:
    """Base of all faults: strikes nobody in its window."""

    window: Window

    def destroys(self, frame: FrameBlock, start_ns: int) -> bool:  # noqa: ARG002 (for those that override it)
        """Return whether an error frame ends this attempt to send `frame` (one row)."""
        return False

    def deliver(self, frame: FrameBlock, start_ns: int) -> FrameBlock:  # noqa: ARG002 (likewise)
        """Return what the receivers get in place of `frame` (a block of one row).

        They get none, one or more; never earlier.
        """
        return frame


class ErrorFrames(Fault):
    """Every attempt in the window ends in an error frame.

    32 in a row take the sender off the bus.
    """

    __slots__ = ()

    def destroys(self, frame: FrameBlock, start_ns: int) -> bool:
        """Destroy the frame inside the window."""
        return self.window.holds(frame, start_ns)


class Lost(Fault):
    """Frames that were acknowledged and yet reach no receiver.

    A gateway or a full driver loses them.
    """

    __slots__ = ()

    def deliver(self, frame: FrameBlock, start_ns: int) -> FrameBlock:
        """Deliver nothing inside the window."""
        return frame.select(slice(0)) if self.window.holds(frame, start_ns) else frame


@dataclass(frozen=True, slots=True)
class Duplicated(Fault):
    """Frames that arrive twice.

    An error in the last bit makes the sender repeat what was already taken.
    """

    delay_ns: int = 0

    def deliver(self, frame: FrameBlock, start_ns: int) -> FrameBlock:
        """Deliver the frame and, `delay_ns` later, its copy."""
        if not self.window.holds(frame, start_ns):
            return frame
        return concatenate_frames([frame, replace(frame, stamp_ns=frame.stamp_ns + self.delay_ns)])


@dataclass(frozen=True, slots=True)
class Delayed(Fault):
    """Frames that arrive `delay_ns` late, behind others that were sent after them."""

    delay_ns: int = 0

    def deliver(self, frame: FrameBlock, start_ns: int) -> FrameBlock:
        """Deliver the frame late."""
        if not self.window.holds(frame, start_ns):
            return frame
        return replace(frame, stamp_ns=frame.stamp_ns + self.delay_ns)


@dataclass(frozen=True, slots=True)
class Corrupted(Fault):
    """Frames whose payload changed although the bus saw a right checksum.

    `flip` is XORed onto the first bytes.
    """

    flip: bytes = field(default=b"\x01")

    def deliver(self, frame: FrameBlock, start_ns: int) -> FrameBlock:
        """Deliver the frame with another payload."""
        if not self.window.holds(frame, start_ns):
            return frame
        data = frame.data.copy()
        count = min(len(self.flip), int(frame.length[0]))
        data[0, :count] ^= np.frombuffer(self.flip, np.uint8)[:count]
        return replace(frame, data=data)


@dataclass(frozen=True, slots=True)
class Reordered(Fault):
    """Every second frame of an id arrives `delay_ns` late.

    The frame is behind its successor where that is more than their gap.
    """

    delay_ns: int = 0
    _struck: dict[int, int] = field(default_factory=dict)

    def deliver(self, frame: FrameBlock, start_ns: int) -> FrameBlock:
        """Deliver the frame late, or as it is."""
        if not self.window.holds(frame, start_ns):
            return frame
        ident = int(frame.ident[0])
        self._struck[ident] = self._struck.get(ident, 0) + 1
        return replace(frame, stamp_ns=frame.stamp_ns + self.delay_ns) if self._struck[ident] % 2 else frame


@dataclass(frozen=True, slots=True)
class _Forged(Fault):
    """Base of faults behind the sender's protection.

    The payload is not what it should be, its CRC is right.
    """

    protections: Mapping[int, tuple[int, Protection]] = field(default_factory=dict)

    def deliver(self, frame: FrameBlock, start_ns: int) -> FrameBlock:
        """Deliver the frame with another payload and the CRC that belongs to it."""
        ident = int(frame.ident[0])
        if ident not in self.protections or not self.window.holds(frame, start_ns):
            return frame
        length, protection = self.protections[ident]
        data = frame.data.copy()
        counter = alive_counter(data[0], int(protection.profile)) if protection.modulus else 0
        protect(data, length, protection, self._forge(ident, data[0], int(counter)))
        return replace(frame, data=data)

    def _forge(self, ident: int, payload: NDArray[np.uint8], counter: int) -> int:  # noqa: ARG002 (for those that override it)
        """Change a payload in place; return the alive counter that it is sent with."""
        return counter


def protections_of(dialect: Dialect) -> dict[int, tuple[int, Protection]]:
    """Return length and protection of each arbitration id.

    Faults behind the protection take them.
    """
    return {message.ident: (message.length, message.protection) for message in dialect.messages}


@dataclass(frozen=True, slots=True)
class CounterJump(_Forged):
    """Alive counters that are `jump` further inside the window than outside."""

    jump: int = 3

    def _forge(self, ident: int, payload: NDArray[np.uint8], counter: int) -> int:  # noqa: ARG002 (one signature)
        return counter + self.jump


@dataclass(frozen=True, slots=True)
class StuckCounter(_Forged):
    """Alive counters that stay as at the window's begin; the content goes on."""

    _held: dict[int, int] = field(default_factory=dict)

    def _forge(self, ident: int, payload: NDArray[np.uint8], counter: int) -> int:  # noqa: ARG002 (one signature)
        return self._held.setdefault(ident, counter)


@dataclass(frozen=True, slots=True)
class Forged(_Forged):
    """Content that changed before its CRC was made.

    `flip` is XORed behind the header, from byte `first` on.
    """

    flip: bytes = b"\x01"
    first: int = 4

    def _forge(self, ident: int, payload: NDArray[np.uint8], counter: int) -> int:  # noqa: ARG002 (one signature)
        payload[self.first : self.first + len(self.flip)] ^= np.frombuffer(self.flip, np.uint8)
        return counter
