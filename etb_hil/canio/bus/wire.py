"""The virtual bus at one instant, as arrays for the compiled kernels.

The state has transmit queues, counters and what was sent.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import numpy as np

from etb_hil.base.errors import BenchFault
from etb_hil.base.rewinding import Rewindable
from etb_hil.canio.bus import arbitration as arb
from etb_hil.canio.bus.health import BusHealth, BusState, LoadMeter
from etb_hil.canio.frames import FrameBlock

if TYPE_CHECKING:
    from numpy.typing import NDArray

Item = TypeVar("Item", bound=np.generic)

QUEUE_ROWS = 256  # powers of two: rings
LOG_ROWS = 4096
MAX_LOG_ROWS = 1 << 20  # what a port that nobody reads may keep before it loses its oldest frames

# Bits of the shortest frame that are always sent at the nominal rate, intermission left out.
_LEAST_CLASSIC_BITS = 44
_LEAST_FD_BITS = 26

_NOTHING = {width: FrameBlock.empty(width) for width in (8, 64)}


class Wire(Rewindable):
    """Ports on a bus of these bit rates (bit/s).

    The wire knows of bits, queues and counters, not of nodes or sleeping.
    """

    LIVES = ("ports", "queue", "payload", "bus", "meter")
    GROWS = ("log", "log_payload")  # rings whose unread rows stay, those of a node alone excepted

    def __init__(self, bitrate: int, data_bitrate: int, *, fd: bool, start_ns: int) -> None:
        self.fd = fd
        self.width = 64 if fd else 8
        self.lookahead_ns = arb.time_ns(_LEAST_FD_BITS if fd else _LEAST_CLASSIC_BITS, bitrate)
        self.ports = np.zeros((0, arb.PORT), np.int64)
        self.queue = np.zeros((0, QUEUE_ROWS, arb.ROW), np.int64)
        self.payload = np.zeros((0, QUEUE_ROWS, self.width), np.uint8)
        self.log = np.zeros((LOG_ROWS, arb.ROW), np.int64)
        self.log_payload = np.zeros((LOG_ROWS, self.width), np.uint8)
        self.meter = LoadMeter(start_ns, bitrate, data_bitrate)
        self.bus = np.zeros(arb.BUS, np.int64)
        self.bus[arb.SENDER] = -1
        self.bus[arb.FREE] = start_ns
        self.bus[arb.NOMINAL], self.bus[arb.DATA], self.bus[arb.FD] = bitrate, data_bitrate, fd
        self.bus[arb.LOOKAHEAD] = self.lookahead_ns

    def open_port(self, *, node: bool, least_key: int = 0) -> int:
        """Return the number of a new port, none of whose frames is below a key.

        BenchFault where there are too many.
        """
        free = np.flatnonzero(self.ports[:, arb.OPEN] == 0)
        if len(free):
            port = int(free[0])
            self.ports[port] = 0
        else:
            port = len(self.ports)
            if port >= arb.MAX_PORTS:
                raise BenchFault(f"a virtual bus has room for {arb.MAX_PORTS} ports; close some that are not needed")
            self.ports, self.queue, self.payload = _longer(self.ports), _longer(self.queue), _longer(self.payload)
        self.ports[port, arb.OPEN] = 1
        self.ports[port, arb.NODE] = node
        self.ports[port, arb.LEAST] = least_key
        self.ports[port, arb.CURSOR] = self.bus[arb.LOGGED]
        return port

    def close_port(self, port: int) -> None:
        """Take a port off; what is still queued is not sent."""
        if self.bus[arb.SENDER] == port:
            self.bus[arb.SENDER] = -1
            self.bus[arb.FREE] = self.bus[arb.END]
        self.ports[port, arb.OPEN] = self.ports[port, arb.WAITING] = 0

    def enqueue(self, port: int, frames: FrameBlock, first_ns: int, last_ns: int, *, at_once: bool) -> None:
        """Append frames to a port's queue as `arbitration.enqueue` does.

        BenchFault names one that cannot be sent.
        """
        data = np.ascontiguousarray(frames.data)
        while True:
            wrong = arb.enqueue(
                self.queue, self.payload, self.ports, self.bus, port, frames.stamp_ns, frames.ident, frames.flags,
                frames.length, data, first_ns, last_ns, at_once,
            )  # fmt: skip
            if wrong != arb.NO_ROOM:
                break
            self.queue, self.payload = _doubled(self.queue), _doubled(self.payload)
        if wrong >= 0:
            what = f"{frames.ident[wrong]:#x} of {frames.length[wrong]} bytes, flags {int(frames.flags[wrong]):#x}"
            raise BenchFault(
                f"frame {what}, stamped {frames.stamp_ns[wrong]} ns, cannot be sent: this bus takes "
                f"{'FD and classic' if self.fd else 'classic'} frames, a node's in order from {first_ns} to {last_ns} "
                "and with the identifiers that it was attached with"
            )

    def collect(self, port: int) -> FrameBlock:
        """Return what the port has seen since the last call.

        Its own frames are flagged `SENT`.
        """
        count = int(self.ports[port, arb.WAITING])
        if not count:
            return _NOTHING[self.width]
        frames = FrameBlock(
            np.empty(count, np.int64),
            np.empty(count, np.uint32),
            np.empty(count, np.uint8),
            np.empty(count, np.uint8),
            np.empty((count, self.width), np.uint8),
            np.zeros(count, np.uint8),
        )
        arb.collect(
            self.log, self.log_payload, self.ports, self.bus, port,
            frames.stamp_ns, frames.ident, frames.flags, frames.length, frames.data,
        )  # fmt: skip
        return frames

    def transmit(self, until_ns: int) -> None:
        """Send what is queued until `until_ns`, undisturbed."""
        while not arb.transmit(
            self.queue, self.payload, self.ports, self.bus, self.log, self.log_payload, self.meter.bins, until_ns
        ):
            self._make_room()

    def append(self, row: NDArray[np.int64], payload: NDArray[np.uint8]) -> None:
        """Log one row for the ports that it says see it."""
        if self.bus[arb.LOGGED] - arb.oldest_unread(self.ports, self.bus) >= len(self.log):
            self._make_room()
        arb.append(self.log, self.log_payload, self.ports, self.bus, row, payload)

    def foretell(self, now_ns: int, until_ns: int) -> bool:
        """Let the node hear of the frame that waits for it; see `arbitration`.

        The frame is sure to end by `until_ns`.
        """
        return bool(
            arb.foretell(
                self.queue, self.payload, self.ports, self.bus, self.log, self.log_payload, now_ns, until_ns
            )
        )  # fmt: skip

    def enqueue_told(self, port: int, node: int, frames: FrameBlock, now_ns: int, until_ns: int) -> FrameBlock:
        """Append frames at their stamps; return what the node hears of them.

        It hears of each as if the bus were free for it; `was_as_told` says whether it was.
        """
        first = int(self.ports[port, arb.TAIL])
        self.enqueue(port, frames, now_ns, until_ns, at_once=False)
        slots = self._slots(port, first)
        self.queue[port, slots, arb.TOLD] = 1 << node
        self.ports[node, arb.RECEIVED] += len(frames)
        ends_ns = frames.stamp_ns + self.queue[port, slots, arb.SPAN]
        return FrameBlock(ends_ns, frames.ident, frames.flags, frames.length, frames.data, frames.channel)

    def was_as_told(self, port: int, told: FrameBlock) -> bool:
        """Return whether a port's last frames have all ended when the node was told."""
        slots = self._slots(port, int(self.ports[port, arb.TAIL]) - len(told))
        all_sent = self.ports[port, arb.HEAD] == self.ports[port, arb.TAIL]
        return bool(all_sent) and np.array_equal(self.queue[port, slots, arb.STAMP], told.stamp_ns)

    def is_quiet(self, node: int) -> bool:
        """Return whether a single other port is open, and has sent all it was given.

        The node has heard of all of it.
        """
        ports = self.ports.tolist()
        others = [port for number, port in enumerate(ports) if port[arb.OPEN] and number != node]
        all_sent = len(others) == 1 and others[0][arb.HEAD] == others[0][arb.TAIL]
        return all_sent and not ports[node][arb.WAITING]

    def _slots(self, port: int, first: int) -> NDArray[np.int64]:
        return np.arange(first, int(self.ports[port, arb.TAIL])) & (self.queue.shape[1] - 1)

    def horizon(self, now_ns: int, until_ns: int) -> int:
        """Return up to when every node may run at once, at most `until_ns`."""
        return int(arb.horizon(self.queue, self.ports, self.bus, now_ns, until_ns))

    def next_end(self, now_ns: int) -> int | None:
        """Return before when no frame known now can end, None where none is known."""
        end = int(arb.next_end(self.queue, self.ports, self.bus, now_ns))
        return end if end < arb.NEVER else None

    def health(self, port: int, now_ns: int) -> BusHealth:
        """Return what the port's own bus controller knows."""
        load, peak = self.meter.load(now_ns)
        row = self.ports[port].tolist()
        passive = row[arb.TEC] > 127 or row[arb.REC] > 127
        state = BusState.ERROR_PASSIVE if passive else BusState.ERROR_ACTIVE
        return BusHealth(
            load=load,
            peak_load=peak,
            sent=row[arb.SENT],
            received=row[arb.RECEIVED],
            error_frames=row[arb.ERRORS],
            transmit_errors=row[arb.TEC],
            receive_errors=row[arb.REC],
            state=BusState.BUS_OFF if row[arb.OFF_LEFT] else state,
            dropped=row[arb.DROPPED],
        )

    def _make_room(self) -> None:
        if len(self.log) >= MAX_LOG_ROWS:
            arb.forget(self.log, self.ports, self.bus, MAX_LOG_ROWS // 2)
        else:
            self.log, self.log_payload = _doubled(self.log[None])[0], _doubled(self.log_payload[None])[0]


def _doubled(ring: NDArray[Item]) -> NDArray[Item]:
    """Return a ring (ports, capacity, ...) of twice the capacity.

    Every row is found at its old number.
    """
    return np.concatenate([ring, ring], axis=1)


def _longer(ports: NDArray[Item]) -> NDArray[Item]:
    """Return an array (ports, ...) with one more port."""
    return np.concatenate([ports, np.zeros((1, *ports.shape[1:]), ports.dtype)])
