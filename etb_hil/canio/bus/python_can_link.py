"""A link over any interface of python-can, at wall clock."""

from __future__ import annotations

import os
import socket
import sys
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import can
import numpy as np

from etb_hil.base.errors import BenchFault, InputError, Place, Problem
from etb_hil.base.nearest import did_you_mean
from etb_hil.canio.bus.bus_settings import VIRTUAL
from etb_hil.canio.bus.health import BusHealth, LoadMeter
from etb_hil.canio.bus.host_stamps import as_they_came, on_our_clock
from etb_hil.canio.bus.link import MOST_AT_ONCE
from etb_hil.canio.bus.serial_adapter import ReadAhead
from etb_hil.canio.frames import FrameBlock, FrameFlag, concatenate_frames
from etb_hil.canio.messages import from_messages, to_message

if TYPE_CHECKING:
    from etb_hil.base.clock import Clock
    from etb_hil.canio.bus.bus_settings import BusSettings

_PATIENCE_NS = 10_000_000  # nor one whose frames take longer to decode than to come
_SEND_TIMEOUT_S = 0.1  # a driver that is not rid of a frame by then has no bus any more
_LOOPING = {"udp_multicast"}  # interfaces that give a sender its own frames back, and cannot be told not to
_SERIAL = "slcan"
_MULTICAST_ALL = {  # of Linux, by address family; Python has no names for them
    socket.AF_INET: (socket.IPPROTO_IP, 49),
    socket.AF_INET6: (socket.IPPROTO_IPV6, 29),
}
_SAME_EPOCH_NS = 10_000_000_000  # a driver's first stamp farther from our clock than this counts from another epoch


class PythonCanLink:
    """A link over `can.Bus`.

    Frames of this side are stamped when the driver took them.

    python-can's interfaces report neither error state nor lost frames in a way that means the same for all, so that
    these stay unknown. What a serial adapter garbled counts as an error frame.
    """

    def __init__(self, settings: BusSettings, clock: Clock) -> None:
        self._settings = settings
        self._clock = clock
        self._looked_ns = clock.now_ns()
        self._bus = _open(settings)
        self._serial = _read_ahead(self._bus) if settings.interface == _SERIAL else None
        self._sent: list[FrameBlock] = []
        self._looped: deque[bytes] | None = deque(maxlen=MOST_AT_ONCE) if settings.interface in _LOOPING else None
        self._offset_ns: int | None = None
        self._meter = LoadMeter(clock.now_ns(), int(settings.bitrate), int(settings.data_bitrate))
        self._sent_count = self._received_count = self._error_frames = 0

    def send(self, frames: FrameBlock) -> None:
        """Hand frames to the driver one by one."""
        stamps = np.empty(len(frames), np.int64)
        for row in range(len(frames)):
            message = to_message(frames, row)
            message.channel = None  # an index in our columns, an address to some drivers
            try:
                self._bus.send(message, _SEND_TIMEOUT_S)
            except (can.CanError, OSError) as error:
                raise self._gone("sent no frame", error) from error
            stamps[row] = self._clock.now_ns()
            if self._looped is not None:
                self._looped.append(_content(frames, row))
        self._sent_count += len(frames)
        self._sent.append(replace(frames, stamp_ns=stamps, flags=frames.flags | np.uint8(FrameFlag.SENT)))

    def receive(self) -> FrameBlock:
        """Return the frames that came or were sent since the last call.

        What takes too long waits for the next one.
        """
        looked_ns, self._looked_ns = self._looked_ns, self._clock.now_ns()
        received = self._without_own(from_messages(self._messages()))
        stamps = as_they_came(self._on_our_clock(received), self._clock.now_ns() - looked_ns)
        received = replace(received, stamp_ns=stamps, channel=np.zeros(len(received), np.uint8))
        errors = int(np.count_nonzero(received.flags & FrameFlag.ERROR))
        self._error_frames += errors
        self._received_count += len(received) - errors
        frames = concatenate_frames([received, *self._sent])
        self._sent = []
        # A host's clock that is set back between two frames changes their stamps, never the order in which they came.
        come_ns = np.concatenate([np.maximum.accumulate(received.stamp_ns), frames.stamp_ns[len(received) :]])
        order = np.argsort(come_ns, kind="stable")
        frames = frames.select(order)
        self._meter.note(frames)
        return frames

    def health(self) -> BusHealth:
        """Return load and counts; error state, error counters and drops are unknown."""
        load, peak = self._meter.load(self._clock.now_ns())
        return BusHealth(load, peak, self._sent_count, self._received_count, self._error_frames, None, None, None, None)

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()

    def _messages(self) -> list[can.Message]:
        messages: list[can.Message] = []
        late_ns = self._clock.now_ns() + _PATIENCE_NS
        while len(messages) < MOST_AT_ONCE and self._clock.now_ns() <= late_ns:
            try:
                message = self._bus.recv(0)
            except (can.CanError, OSError) as error:
                raise self._gone("cannot be read", error) from error
            except (ValueError, IndexError):
                if self._serial is None:
                    raise
                self._error_frames += 1  # a line that lost some of its characters
                continue
            if message is None:
                if self._serial is None or not self._serial.held:  # else it was an adapter's answer to a command
                    break
            elif self._serial is not None and not _is_whole(message):
                self._error_frames += 1
            else:
                messages.append(message)
        return messages

    def _without_own(self, received: FrameBlock) -> FrameBlock:
        """Leave out what the network looped back to its sender."""
        if not self._looped:
            return received
        others = np.ones(len(received), np.bool_)
        for row in range(len(received)):
            content = _content(received, row)
            if content in self._looped:
                self._looped.remove(content)
                others[row] = False
        return received.select(others)

    def _on_our_clock(self, received: FrameBlock) -> np.ndarray[Any, np.dtype[np.int64]]:
        """Return stamps on our clock.

        Some drivers count from power-on, some do not stamp at all (0).
        """
        if not len(received):
            return received.stamp_ns
        now = self._clock.now_ns()
        stamped, ours = received.stamp_ns > 0, on_our_clock(received.stamp_ns, self._clock)
        if self._offset_ns is None and stamped.any():
            is_near = abs(now - int(ours[stamped][-1])) < _SAME_EPOCH_NS
            self._offset_ns = 0 if is_near else now - int(received.stamp_ns[stamped][-1])
        return np.where(stamped, received.stamp_ns + self._offset_ns if self._offset_ns else ours, now)

    def _gone(self, what: str, error: Exception) -> BenchFault:
        settings = self._settings
        return BenchFault(
            f"{settings.interface} channel '{settings.channel}' {what}: {error}; check that the adapter is plugged "
            "in, its driver up, and another node on the bus to acknowledge"
        )


def _content(frames: FrameBlock, row: int) -> bytes:
    flags = frames.flags[row] & ~np.uint8(FrameFlag.SENT)
    return bytes((flags,)) + frames.ident[row].tobytes() + frames.data[row, : frames.length[row]].tobytes()


def require_interface(settings: BusSettings, place: Place | None = None) -> None:
    """Raise InputError where python-can has no interface of this name.

    `place` is where the bench file says it.
    """
    if settings.interface not in can.VALID_INTERFACES:
        raise InputError(
            Problem(
                "no such CAN interface",
                place,
                settings.interface,
                ", ".join(sorted({*can.VALID_INTERFACES, VIRTUAL})),
                did_you_mean(settings.interface, can.VALID_INTERFACES, "correct bus.interface"),
            )
        )


def _open(settings: BusSettings) -> can.BusABC:
    require_interface(settings)
    rates: dict[str, Any] = {"bitrate": int(settings.bitrate), "fd": settings.fd}
    if settings.fd:
        rates["data_bitrate"] = int(settings.data_bitrate)
    try:
        bus = can.Bus(interface=settings.interface, channel=settings.channel, **(rates | settings.options))
    except (can.CanError, OSError, ImportError, ValueError, TypeError, NotImplementedError) as error:
        raise BenchFault(
            f"{settings.interface} channel '{settings.channel}' cannot be opened: {error}; check the channel's "
            "name, the adapter's driver, and that the options are those of python-can for this interface"
        ) from error
    if settings.interface in _LOOPING and sys.platform == "linux":
        _keep_to_group(bus)
    return bus


def _keep_to_group(bus: can.BusABC) -> None:
    """Let a multicast bus hear its own group alone.

    Linux gives a socket what is sent to any group that anybody on the machine has joined, as long as the port is the
    same: two benches on two channels would hear, and judge, each other's controller.
    """
    with socket.socket(fileno=os.dup(bus.fileno())) as port:
        port.setsockopt(*_MULTICAST_ALL[port.family], 0)


def _is_whole(message: can.Message) -> bool:
    return message.is_remote_frame or len(message.data) == message.dlc <= (64 if message.is_fd else 8)


def _read_ahead(bus: can.BusABC) -> ReadAhead:
    bus.flush()  # type: ignore[attr-defined]  # what came before is of nobody's run; this and the port: slcan alone
    port = ReadAhead(bus.serialPortOrig)  # type: ignore[attr-defined]
    bus.serialPortOrig = port  # type: ignore[attr-defined]
    return port
