"""A link over Linux SocketCAN, straight on its raw socket.

python-can rounds the kernel's nanoseconds to a float and does not see frames that the kernel dropped; the standard
library's sockets give both, and spare a message object for every frame.
"""

from __future__ import annotations

import errno
import socket
import struct
from typing import TYPE_CHECKING, Any

import numpy as np

from etb_hil.base.errors import BenchFault, InputError, Problem
from etb_hil.canio.bus.health import BusHealth, BusState, LoadMeter
from etb_hil.canio.bus.host_stamps import as_they_came, on_our_clock
from etb_hil.canio.bus.interface_details import interface_details, interface_rates, rates_as_options
from etb_hil.canio.bus.link import MOST_AT_ONCE
from etb_hil.canio.frames import FrameBlock, FrameFlag

if TYPE_CHECKING:
    from etb_hil.base.clock import Clock
    from etb_hil.canio.bus.bus_settings import BusSettings

_BUFFER_BYTES = 8 << 20  # an unread socket of the default size keeps 278 frames
_SO_RCVBUFFORCE, _SO_TIMESTAMPNS, _SO_RXQ_OVFL = 33, 35, 40  # asm-generic/socket.h
_CAN_RAW_ERR_FILTER, _ALL_ERRORS = 2, 0x1FFFFFFF  # linux/can/raw.h; not in every build of Python
_ANCILLARY = socket.CMSG_SPACE(16) + socket.CMSG_SPACE(4)
_TIMESPEC = struct.Struct("@qq")
_COUNT = struct.Struct("@I")

# struct can_frame and canfd_frame of linux/can.h; a classic frame fills the first 16 bytes.
_FRAME = np.dtype([("id", "<u4"), ("length", "u1"), ("flags", "u1"), ("reserved", "V2"), ("data", "u1", 64)])
_CLASSIC_BYTES, _FD_BYTES = 16, 72
_ID_EXTENDED, _ID_REMOTE, _ID_ERROR = 0x80000000, 0x40000000, 0x20000000
_FD_BRS, _FD_ESI = 1, 2

# Error classes and details of linux/can/error.h
_ERR_CONTROLLER, _ERR_BUS_OFF, _ERR_RESTARTED, _ERR_COUNTERS = 0x004, 0x040, 0x100, 0x200
_CONTROLLER_PASSIVE, _CONTROLLER_ACTIVE = 0x30, 0x4C  # warning still is error active

_QUEUE_FULL = "its transmit queue is full: check that another node acknowledges, and the bit rate"
_REMEDIES = {
    errno.ENETDOWN: "bring it up: ip link set {channel} up",
    errno.ENODEV: "plug the adapter in, or create the interface, then see: ip link show {channel}",
    errno.ENXIO: "plug the adapter in, or create the interface, then see: ip link show {channel}",
    errno.ENOBUFS: _QUEUE_FULL,
    errno.EAGAIN: _QUEUE_FULL,
    errno.EINVAL: "it may take no FD frames: ip link set {channel} mtu 72, with fd on and a dbitrate on hardware",
}


class SocketCanLink:
    """A link over a SocketCAN interface.

    Stamps are the kernel's, frames of this side come back when they were sent.
    """

    def __init__(self, settings: BusSettings, clock: Clock) -> None:
        self._settings = settings
        self._clock = clock
        self._state, self._counters = _controller_state(settings)
        self._looked_ns = clock.now_ns()
        self._socket = self._open()
        self._meter = LoadMeter(clock.now_ns(), int(settings.bitrate), int(settings.data_bitrate))
        self._sent = self._received = self._error_frames = self._dropped = 0

    def send(self, frames: FrameBlock) -> None:
        """Hand frames to the kernel's transmit queue."""
        wire = np.zeros(len(frames), _FRAME)
        flags = frames.flags
        wire["id"] = (
            frames.ident
            | np.where(flags & FrameFlag.EXTENDED, np.uint32(_ID_EXTENDED), np.uint32(0))
            | np.where(flags & FrameFlag.REMOTE, np.uint32(_ID_REMOTE), np.uint32(0))
        )
        wire["length"] = frames.length
        wire["flags"] = np.where(flags & FrameFlag.BITRATE_SWITCH, _FD_BRS, 0)
        wire["data"][:, : frames.data.shape[1]] = frames.data
        raw = wire.tobytes()
        for row, flag in enumerate(flags.tolist()):
            size = _FD_BYTES if flag & FrameFlag.FD else _CLASSIC_BYTES
            try:
                # A full queue is a fault now, never a wait: on a bus without a listener it would last for ever.
                self._socket.send(raw[row * _FD_BYTES : row * _FD_BYTES + size], socket.MSG_DONTWAIT)
            except OSError as error:
                raise self._fault("sent no frame", error) from error

    def receive(self) -> FrameBlock:
        """Return all frames that the kernel has seen since the last call."""
        raw: list[bytes] = []
        stamps: list[int] = []
        own: list[int] = []
        receive = self._socket.recvmsg
        looked_ns, self._looked_ns = self._looked_ns, self._clock.now_ns()
        try:
            while len(raw) < MOST_AT_ONCE:
                frame, ancillary, flags, _ = receive(_FD_BYTES, _ANCILLARY, socket.MSG_DONTWAIT)
                raw.append(frame)
                own.append(flags & socket.MSG_CONFIRM)
                stamps.append(self._read_ancillary(ancillary))
        except BlockingIOError:
            pass  # nothing more is waiting
        except OSError as error:
            raise self._fault("cannot be read", error) from error
        if not raw:
            return FrameBlock.empty()
        ours = on_our_clock(np.array(stamps, np.int64), self._clock)
        frames = _columns(raw, as_they_came(ours, self._clock.now_ns() - looked_ns), own)
        self._count(frames)
        return frames

    def health(self) -> BusHealth:
        """Return load and counts.

        State and error counters where the driver ever reported them.
        """
        load, peak = self._meter.load(self._clock.now_ns())
        transmit_errors, receive_errors = self._counters
        return BusHealth(
            load, peak, self._sent, self._received, self._error_frames,
            transmit_errors, receive_errors, self._state, self._dropped,
        )  # fmt: skip

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _open(self) -> socket.socket:
        settings = self._settings
        try:
            raw = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        except OSError as error:
            raise BenchFault(f"this kernel has no SocketCAN: {error.strerror}; load it: modprobe can_raw") from error
        try:
            raw.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_RECV_OWN_MSGS, 1)
            raw.setsockopt(socket.SOL_CAN_RAW, _CAN_RAW_ERR_FILTER, _ALL_ERRORS)
            if settings.fd:
                raw.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
            raw.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
            raw.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)
            try:
                raw.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, _BUFFER_BYTES)
            except PermissionError:  # then as much as the system allows everybody
                raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
            raw.bind((settings.channel,))
        except OSError as error:
            raw.close()
            raise self._fault("cannot be opened", error) from error
        return raw

    def _read_ancillary(self, ancillary: list[tuple[int, int, bytes]]) -> int:
        stamp = 0
        for _, kind, data in ancillary:
            if kind == _SO_TIMESTAMPNS:
                seconds, nanoseconds = _TIMESPEC.unpack_from(data)
                stamp = seconds * 1_000_000_000 + nanoseconds
            elif kind == _SO_RXQ_OVFL:
                (self._dropped,) = _COUNT.unpack_from(data)
        return stamp

    def _count(self, frames: FrameBlock) -> None:
        self._meter.note(frames)
        errors = np.flatnonzero(frames.flags & FrameFlag.ERROR)
        own = int(np.count_nonzero(frames.flags & FrameFlag.SENT))
        self._sent += own
        self._error_frames += len(errors)
        self._received += len(frames) - own - len(errors)
        for row in errors:
            self._read_error_frame(int(frames.ident[row]), frames.data[row])

    def _read_error_frame(self, error_class: int, data: np.ndarray[Any, np.dtype[np.uint8]]) -> None:
        if error_class & _ERR_COUNTERS:
            self._counters = int(data[6]), int(data[7])
        if error_class & _ERR_CONTROLLER and data[1] & _CONTROLLER_PASSIVE:
            self._state = BusState.ERROR_PASSIVE
        elif error_class & _ERR_CONTROLLER and data[1] & _CONTROLLER_ACTIVE:
            self._state = BusState.ERROR_ACTIVE
        if error_class & _ERR_RESTARTED:
            self._state = BusState.ERROR_ACTIVE
        if error_class & _ERR_BUS_OFF:
            self._state = BusState.BUS_OFF

    def _fault(self, what: str, error: OSError) -> BenchFault:
        channel = self._settings.channel
        remedy = _REMEDIES.get(error.errno or 0, "see: ip -details link show {channel}").format(channel=channel)
        return BenchFault(f"socketcan interface '{channel}' {what}: {error.strerror}; {remedy}")


def _columns(raw: list[bytes], stamps: np.ndarray[Any, np.dtype[np.int64]], own: list[int]) -> FrameBlock:
    wire = np.frombuffer(b"".join(frame.ljust(_FD_BYTES, b"\0") for frame in raw), _FRAME)
    is_fd = np.array([len(frame) == _FD_BYTES for frame in raw])
    ident = wire["id"]
    error = (ident & _ID_ERROR) != 0
    flags = (
        np.where(ident & _ID_EXTENDED, FrameFlag.EXTENDED, 0)
        | np.where(ident & _ID_REMOTE, FrameFlag.REMOTE, 0)
        | np.where(error, FrameFlag.ERROR, 0)
        | np.where(is_fd, FrameFlag.FD, 0)
        | np.where(is_fd & ((wire["flags"] & _FD_BRS) != 0), FrameFlag.BITRATE_SWITCH, 0)
        | np.where(is_fd & ((wire["flags"] & _FD_ESI) != 0), FrameFlag.ERROR_STATE, 0)
        | np.where(np.array(own) != 0, FrameFlag.SENT, 0)
    )
    return FrameBlock(
        stamps,
        ident & np.uint32(0x1FFFFFFF),
        flags.astype(np.uint8),
        wire["length"].copy(),
        wire["data"][:, : 64 if is_fd.any() else 8].copy(),  # one row alone would stay read-only: another kernel
        np.zeros(len(raw), np.uint8),
    )


def _controller_state(settings: BusSettings) -> tuple[BusState | None, tuple[int | None, int | None]]:
    """Ask the driver once for state and error counters.

    Later error frames keep them up to date.

    Raises InputError where the interface runs at another bit rate than the settings say, in either phase of FD frames.
    """
    data = interface_details(settings.channel)
    if data is None:
        return None, (None, None)
    for rate in interface_rates(settings, data):
        if rate.found is not None and rate.found != rate.wanted:
            phase = "" if rate.key == "bitrate" else " in the data phase"
            raise InputError(
                Problem(
                    f"the interface {settings.channel} runs at {rate.found} bit/s{phase}",
                    value=rate.wanted,
                    remedy=f"set bus.{rate.key}, or: ip link set {settings.channel} {rates_as_options(settings)}",
                )
            )
    word = str(data.get("state", "")).lower().replace("error-warning", "error-active")
    counters = data.get("berr_counter", {})
    return (BusState(word) if word in set(BusState) else None), (counters.get("tx"), counters.get("rx"))
