"""The deterministic CAN bus: real frame times and arbitration in virtual time, the same frames in every run."""

from __future__ import annotations

import heapq
import itertools
from threading import RLock
from typing import TYPE_CHECKING, Protocol, TypeVar
from weakref import WeakValueDictionary

import numpy as np

from etb_hil.base.errors import BenchFault, InputError, Problem
from etb_hil.canio import arbitration as arb
from etb_hil.canio.frames import FrameBlock, FrameFlag, concatenate_frames
from etb_hil.canio.health import BusHealth, BusState, LoadMeter

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from etb_hil.base.clock import Clock
    from etb_hil.canio.faults import Fault

Item = TypeVar("Item", bound=np.generic)

_QUEUE_ROWS = 256  # powers of two: rings
_LOG_ROWS = 4096
_MAX_LOG_ROWS = 1 << 20  # what a port that nobody reads may keep before it loses its oldest frames

# Bits of the shortest frame that are always sent at the nominal rate, intermission left out.
_LEAST_CLASSIC_BITS = 44
_LEAST_FD_BITS = 26


class Node(Protocol):
    """A device on the bus that lives in virtual time."""

    def run(self, until_ns: int, inbox: FrameBlock) -> FrameBlock:
        """Live from where the last call ended up to and including `until_ns`.

        `inbox` holds what other senders' frames ended on the bus until now; what the node does later than a frame's
        stamp may depend on it. Returns the frames that the node hands to its transmitter meanwhile, each stamped with
        the instant at which it does, in order. How time is cut into calls must not change what the node does.
        """
        ...


class VirtualNetwork:
    """A CAN bus in virtual time with its nodes and opened buses, each with a FIFO transmit queue.

    `bitrate` and `data_bitrate` in bit/s; `fd` allows FD frames; time starts at `start_ns`. `faults` may be changed at
    any time; while it is empty everything runs compiled. Frames are stamped at the end of frame, before intermission.
    """

    def __init__(
        self,
        bitrate: int = 500_000,
        data_bitrate: int = 2_000_000,
        *,
        fd: bool = False,
        start_ns: int = 0,
        faults: Sequence[Fault] = (),
    ) -> None:
        for name, rate in (("bitrate", bitrate), ("data_bitrate", data_bitrate)):
            if not 1_000 <= rate <= 20_000_000:
                raise InputError(Problem(f"{name} is no bit rate of CAN", value=rate, allowed="1 kbit/s to 20 Mbit/s"))
        self.bitrate, self.data_bitrate, self.fd = bitrate, data_bitrate, fd
        self.faults: Sequence[Fault] = faults
        self.lock = RLock()  # python-can's users may read and send from several threads
        self._now = start_ns
        self._nodes: dict[int, Node] = {}
        self._order = itertools.count()  # frames late to the same instant arrive in the order of sending
        self._late: list[tuple[int, int, NDArray[np.int64], NDArray[np.uint8]]] = []
        self._width = 64 if fd else 8
        self._ports = np.zeros((0, arb.PORT), np.int64)
        self._queue = np.zeros((0, _QUEUE_ROWS, arb.ROW), np.int64)
        self._payload = np.zeros((0, _QUEUE_ROWS, self._width), np.uint8)
        self._log = np.zeros((_LOG_ROWS, arb.ROW), np.int64)
        self._log_payload = np.zeros((_LOG_ROWS, self._width), np.uint8)
        self._meter = LoadMeter(start_ns, bitrate, data_bitrate)
        self._bus = np.zeros(arb.BUS, np.int64)
        self._bus[arb.SENDER] = -1
        self._bus[arb.FREE] = start_ns
        self._bus[arb.NOMINAL], self._bus[arb.DATA], self._bus[arb.FD] = bitrate, data_bitrate, fd
        self._bus[arb.LOOKAHEAD] = arb.time_ns(_LEAST_FD_BITS if fd else _LEAST_CLASSIC_BITS, bitrate)

    @property
    def clock(self) -> Clock:
        """The clock on which this network lives: sleeping on it lets the network and all its nodes live."""
        return self

    def now_ns(self) -> int:
        """Return the virtual time in nanoseconds."""
        return self._now

    def sleep_until_ns(self, deadline_ns: int) -> None:
        """Let the network and its nodes live until `deadline_ns`."""
        with self.lock:
            while self._now < deadline_ns:
                self.step(deadline_ns)

    def step(self, until_ns: int) -> None:
        """Move on to `until_ns`, or to the next instant at which a frame may reach a node, whichever comes first."""
        with self.lock:
            now = self._now
            until = until_ns
            if self._nodes:
                until = arb.horizon(self._queue, self._ports, self._bus, now, until)
                if self._late:
                    until = min(until, self._late[0][0])
            for port, node in self._nodes.items():
                frames = node.run(until, self.collect(port))
                if len(frames):
                    self._enqueue(port, frames, now, until, at_once=False)
            if self.faults or self._late:
                self._transmit_with_faults(until)
            else:
                while not arb.transmit(
                    self._queue,
                    self._payload,
                    self._ports,
                    self._bus,
                    self._log,
                    self._log_payload,
                    self._meter.bins,
                    until,
                ):
                    self._make_room()
            self._now = until

    def step_to_delivery(self, until_ns: int | None) -> None:
        """Move on by one step that passes no delivery unnoticed; `until_ns` bounds it, None leaves it unbounded."""
        with self.lock:
            lookahead = int(self._bus[arb.LOOKAHEAD])
            if self._nodes:  # whose frames are not known before they live
                until = self._now + lookahead
            else:
                until = arb.next_end(self._queue, self._ports, self._bus, self._now)
                if self._late:
                    until = min(until, self._late[0][0])
            self.step(until if until_ns is None else min(until, until_ns))

    @property
    def idle(self) -> bool:
        """Whether no frame can ever come: nothing is queued and no node is attached."""
        pending = arb.next_end(self._queue, self._ports, self._bus, self._now) < arb.NEVER
        return not (self._nodes or self._late or pending)

    def attach(self, node: Node) -> None:
        """Let a device take part; it lives from now on."""
        with self.lock:
            port = self.open_port()
            self._ports[port, arb.NODE] = 1
            self._nodes[port] = node

    def open_port(self) -> int:
        """Return the number of a new access to the bus, for `send` and `collect`."""
        with self.lock:
            free = np.flatnonzero(self._ports[:, arb.OPEN] == 0)
            if len(free):
                port = int(free[0])
                self._ports[port] = 0
            else:
                port = len(self._ports)
                if port >= arb.MAX_PORTS:
                    raise BenchFault(
                        f"a virtual bus has room for {arb.MAX_PORTS} ports; close some that are not needed"
                    )
                grown = [np.concatenate([a, np.zeros((1, *a.shape[1:]), a.dtype)]) for a in (self._ports, self._queue)]
                self._ports, self._queue = grown
                self._payload = np.concatenate([self._payload, np.zeros((1, *self._payload.shape[1:]), np.uint8)])
            self._ports[port, arb.OPEN] = 1
            self._ports[port, arb.CURSOR] = self._bus[arb.LOGGED]
            return port

    def close_port(self, port: int) -> None:
        """Leave the bus; what is still queued is not sent."""
        with self.lock:
            if self._bus[arb.SENDER] == port:
                self._bus[arb.SENDER] = -1
                self._bus[arb.FREE] = self._bus[arb.END]
            self._ports[port, arb.OPEN] = self._ports[port, arb.WAITING] = 0

    def send(self, port: int, frames: FrameBlock) -> None:
        """Hand frames to the port's transmitter now, in order; their stamps are not looked at."""
        with self.lock:
            self._enqueue(port, frames, self._now, self._now, at_once=True)

    def collect(self, port: int) -> FrameBlock:
        """Return what the port has seen since the last call, its own frames flagged `SENT`."""
        with self.lock:
            count = int(self._ports[port, arb.WAITING])
            if not count:
                return _NOTHING[self._width]
            frames = FrameBlock(
                np.empty(count, np.int64),
                np.empty(count, np.uint32),
                np.empty(count, np.uint8),
                np.empty(count, np.uint8),
                np.empty((count, self._width), np.uint8),
                np.zeros(count, np.uint8),
            )
            arb.collect(
                self._log, self._log_payload, self._ports, self._bus, port,
                frames.stamp_ns, frames.ident, frames.flags, frames.length, frames.data,
            )  # fmt: skip
            return frames

    def health(self, port: int) -> BusHealth:
        """Return what the port's own bus controller knows."""
        with self.lock:
            load, peak = self._meter.load(self._now)
            row = self._ports[port].tolist()
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

    def _enqueue(self, port: int, frames: FrameBlock, first_ns: int, last_ns: int, *, at_once: bool) -> None:
        waiting = int(self._ports[port, arb.TAIL] - self._ports[port, arb.HEAD])
        while waiting + len(frames) > self._queue.shape[1]:
            self._queue, self._payload = _doubled(self._queue), _doubled(self._payload)
        wrong = arb.enqueue(
            self._queue, self._payload, self._ports, self._bus, port, frames.stamp_ns, frames.ident, frames.flags,
            frames.length, frames.data, first_ns, last_ns, at_once,
        )  # fmt: skip
        if wrong >= 0:
            what = f"{frames.ident[wrong]:#x} of {frames.length[wrong]} bytes, flags {int(frames.flags[wrong]):#x}"
            raise BenchFault(
                f"frame {what}, stamped {frames.stamp_ns[wrong]} ns, cannot be sent: this bus takes "
                f"{'FD and classic' if self.fd else 'classic'} frames, a node's in order from {first_ns} to {last_ns}"
            )

    def _make_room(self) -> None:
        if len(self._log) >= _MAX_LOG_ROWS:
            arb.forget(self._log, self._ports, self._bus, _MAX_LOG_ROWS // 2)
        else:
            self._log, self._log_payload = _doubled(self._log[None])[0], _doubled(self._log_payload[None])[0]

    def _transmit_with_faults(self, until_ns: int) -> None:
        bus, ports = self._bus, self._ports
        while True:
            if bus[arb.SENDER] < 0:
                if not arb.start_next(self._queue, ports, bus, until_ns):
                    break
                frame, start = self._under_way(), int(bus[arb.START])
                if any(fault.destroys(frame, start) for fault in self.faults):
                    arb.spoil(bus)
            end = int(bus[arb.END])
            if end > until_ns:
                break
            self._append_late(end)
            if bus[arb.DESTROYED]:
                arb.destroy(ports, bus, self._meter.bins)
                self._append(_error_row(end, arb.audience(ports, -1)), np.zeros(self._width, np.uint8))
                continue
            start, sender = int(bus[arb.START]), int(bus[arb.SENDER])
            row, data = arb.finish(self._queue, self._payload, ports, bus, self._meter.bins)
            self._deliver(row, data, start, sender)
        self._append_late(until_ns)

    def _under_way(self) -> FrameBlock:
        sender = self._bus[arb.SENDER]
        slot = self._ports[sender, arb.HEAD] & (self._queue.shape[1] - 1)
        row = self._queue[sender, slot].copy()
        row[arb.STAMP] = self._bus[arb.END]
        return _block(row, self._payload[sender, slot])

    def _deliver(self, row: NDArray[np.int64], data: NDArray[np.uint8], start_ns: int, sender: int) -> None:
        """Log the frame for its sender as it was sent, and for the others as the faults leave it."""
        frame = _block(row, data)
        for fault in self.faults:
            parts = [fault.deliver(frame.rows(slice(i, i + 1)), start_ns) for i in range(len(frame))]
            frame = concatenate_frames(parts)
        own = row.copy()
        own[arb.SEEN_BY] &= 1 << sender
        self._append(own, data)
        for index in range(len(frame)):
            other = row.copy()
            other[arb.STAMP] = max(int(frame.stamp_ns[index]), int(row[arb.STAMP]))
            other[arb.SEEN_BY] &= ~(1 << sender)
            other[arb.IDENT], other[arb.FLAGS], other[arb.LENGTH] = (
                frame.ident[index],
                frame.flags[index],
                frame.length[index],
            )
            payload = frame.data[index].copy()
            if other[arb.STAMP] > row[arb.STAMP]:
                heapq.heappush(self._late, (int(other[arb.STAMP]), next(self._order), other, payload))
            else:
                self._append(other, payload)

    def _append_late(self, until_ns: int) -> None:
        while self._late and self._late[0][0] <= until_ns:
            _, _, row, payload = heapq.heappop(self._late)
            self._append(row, payload)

    def _append(self, row: NDArray[np.int64], payload: NDArray[np.uint8]) -> None:
        if self._bus[arb.LOGGED] - arb.oldest_unread(self._ports, self._bus) >= len(self._log):
            self._make_room()
        arb.append(self._log, self._log_payload, self._ports, self._bus, row, payload)


_NOTHING = {width: FrameBlock.empty(width) for width in (8, 64)}


def _doubled(ring: NDArray[Item]) -> NDArray[Item]:
    """Return a ring (ports, capacity, ...) of twice the capacity; every row is found at its old number."""
    return np.concatenate([ring, ring], axis=1)


def _block(row: NDArray[np.int64], data: NDArray[np.uint8]) -> FrameBlock:
    """Return one row of queue or log as frames."""
    return FrameBlock(
        row[[arb.STAMP]],
        row[[arb.IDENT]].astype(np.uint32),
        row[[arb.FLAGS]].astype(np.uint8),
        row[[arb.LENGTH]].astype(np.uint8),
        data[None].copy(),
        np.zeros(1, np.uint8),
    )


def _error_row(stamp_ns: int, seen_by: int) -> NDArray[np.int64]:
    row = np.zeros(arb.ROW, np.int64)
    row[arb.STAMP], row[arb.SOURCE], row[arb.SEEN_BY], row[arb.FLAGS] = stamp_ns, -1, seen_by, FrameFlag.ERROR
    return row


# A network lives as long as somebody holds it: a bus, or the bench that attached nodes to it.
_NETWORKS: WeakValueDictionary[str, VirtualNetwork] = WeakValueDictionary()


def network_names() -> list[str]:
    """Return the names of the networks that are alive in this process."""
    return sorted(_NETWORKS)


def named_network(
    name: str, bitrate: int = 500_000, data_bitrate: int = 2_000_000, *, fd: bool = False
) -> VirtualNetwork:
    """Return the network of that name in this process, created where there is none yet.

    Raises InputError where it exists with other bit rates.
    """
    network = _NETWORKS.get(name)
    if network is None:
        _NETWORKS[name] = network = VirtualNetwork(bitrate, data_bitrate, fd=fd)
        return network
    there = (network.bitrate, network.data_bitrate if network.fd else None, network.fd)
    asked = (bitrate, data_bitrate if fd else None, fd)
    if there != asked:
        raise InputError(
            Problem(
                f"the virtual bus '{name}' is open with other settings",
                value=asked,
                allowed=f"(bitrate, data_bitrate, fd) = {there}",
                remedy="open all its buses alike, or choose another channel name",
            )
        )
    return network
