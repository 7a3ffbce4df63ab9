"""The deterministic CAN bus: the same frames in every run.

The bus has real frame times and arbitration in virtual time.
"""

from __future__ import annotations

from threading import RLock
from typing import TYPE_CHECKING, Protocol
from weakref import WeakValueDictionary

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.rewinding import Mark, Rewindable
from etb_hil.canio.bus.arbitration import arbitration_key
from etb_hil.canio.bus.fault_injection import FaultInjection
from etb_hil.canio.bus.wire import Wire
from etb_hil.canio.frames import FrameFlag, concatenate_frames

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from etb_hil.base.clock import Clock
    from etb_hil.canio.bus.faults import Fault
    from etb_hil.canio.bus.health import BusHealth
    from etb_hil.canio.frames import FrameBlock


class Node(Protocol):
    """A device on the bus that lives in virtual time."""

    def run(self, until_ns: int, inbox: FrameBlock) -> FrameBlock:
        """Live from where the last call ended up to and including `until_ns`.

        `inbox` holds what other senders' frames ended on the bus until now, or are sure to end by `until_ns`; what the
        node does later than a frame's stamp may depend on it. Returns the frames that the node hands to its
        transmitter meanwhile, each stamped with the instant at which it does, in order. How time is cut into calls must
        not change what the node does.
        """
        ...


class VirtualNetwork(Rewindable):
    """A CAN bus in virtual time with its nodes and opened buses.

    Each has a FIFO transmit queue.

    `bitrate` and `data_bitrate` in bit/s; `fd` allows FD frames; time starts at `start_ns`. `faults` may be changed at
    any time; while none can strike, everything runs compiled. Frames are stamped at their end, before intermission.
    """

    LIVES = ("_now", "_wire", "_nodes")

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
                raise InputError(
                    Problem(f"{name} must be a bit rate of CAN", value=rate, allowed="1 kbit/s to 20 Mbit/s")
                )
        self.bitrate, self.data_bitrate, self.fd = bitrate, data_bitrate, fd
        self.faults: Sequence[Fault] = faults
        self.lock = RLock()  # python-can's users may read and send from several threads
        self._now = start_ns
        self._nodes: dict[int, Node] = {}
        self._senders: dict[int, Node] = {}  # nodes that do not answer
        self._wire = Wire(bitrate, data_bitrate, fd=fd, start_ns=start_ns)
        self._injection = FaultInjection(self._wire)
        self._is_free = True  # as far as known, for each frame that is sent ahead

    @property
    def clock(self) -> Clock:
        """The clock on which this network lives.

        Sleeping on it lets the network and all its nodes live.
        """
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
        """Move on to `until_ns`, or to when a frame may reach a node.

        Whichever comes first counts.
        """
        with self.lock:
            wire, now = self._wire, self._now
            is_left = self._injection.is_needed
            undisturbed = not self.faults and not is_left
            for port, sender in self._senders.items():
                self._hand_over(port, sender, until_ns)
            if self._nodes and not (undisturbed and wire.foretell(now, until_ns)):
                until_ns = self._before_arrival(wire.horizon(now, until_ns))
            for port, node in self._nodes.items():
                self._hand_over(port, node, until_ns)
            faults = self._injection.due(self.faults, until_ns) if self.faults else ()
            if faults or is_left:
                self._injection.transmit(faults, until_ns)
            else:
                wire.transmit(until_ns)
            self._now = until_ns

    def _hand_over(self, port: int, node: Node, until_ns: int) -> None:
        frames = node.run(until_ns, self._wire.collect(port))
        if len(frames.stamp_ns):
            self._wire.enqueue(port, frames, self._now, until_ns, at_once=False)

    @property
    def can_rewind(self) -> bool:
        """Whether `ahead` may be called now.

        There is one node, which can be rewound, and one access, which waits for nothing; no fault is injected.
        """
        if len(self._nodes) != 1 or self.faults or self._injection.is_needed:
            return False
        ((port, node),) = self._nodes.items()
        return isinstance(node, Rewindable) and node.can_rewind and self._wire.is_quiet(port)

    def ahead(self, port: int, frames: FrameBlock, until_ns: int, mark: Mark) -> None:
        """Send frames at their stamps, and move on to `until_ns`.

        `mark` is the present state. The node hears of all frames before it lives, as if the bus were free for each.
        Where one of them has to wait, these and all later frames are sent one by one.
        """
        with self.lock:
            if self._is_free and self._in_one_step(port, frames, until_ns):
                return
            if self._is_free:
                self._is_free = False
                self.rewind(mark)
            for row, stamp_ns in enumerate(frames.stamp_ns.tolist()):
                self.sleep_until_ns(stamp_ns)
                self.send(port, frames.select(slice(row, row + 1)))
            self.sleep_until_ns(until_ns)

    def _in_one_step(self, port: int, frames: FrameBlock, until_ns: int) -> bool:
        """Return whether the frames were sent as the node was told."""
        wire = self._wire
        ((own, node),) = self._nodes.items()
        told = wire.enqueue_told(port, own, frames, self._now, until_ns)
        made = node.run(until_ns, concatenate_frames([wire.collect(own), told]))
        if len(made):
            wire.enqueue(own, made, self._now, until_ns, at_once=False)
        wire.transmit(until_ns)
        self._now = until_ns
        return wire.was_as_told(port, told)

    def step_to_delivery(self, deadline_ns: int | None) -> None:
        """Move on by one step that passes no delivery unnoticed.

        The clock goes at most to `deadline_ns` (None: no bound).

        Nothing happens where no frame is known, no node is attached and no deadline given.
        """
        with self.lock:
            # What nodes will send is not known before they live.
            until = self._now + self._wire.lookahead_ns if self._lives else self._wire.next_end(self._now)
            bounds = [t for t in (until, self._injection.next_arrival_ns, deadline_ns) if t is not None]
            if bounds:
                self.step(min(bounds))

    @property
    def idle(self) -> bool:
        """Whether no frame can ever come: nothing is under way and no node is attached."""
        under_way = self._wire.next_end(self._now) or self._injection.next_arrival_ns
        return not self._lives and under_way is None

    def attach(self, node: Node, sends: Iterable[tuple[int, bool]] = (), *, answers: bool = True) -> None:
        """Let a device take part; it lives from now on.

        `sends` are the identifiers (and whether they are extended) of all frames that it may send, where they are
        known: what is sure to win over them need not interrupt it, which halves the cost of a command a tick.

        A device that does not answer sends the same whatever it hears. It lives ahead of those that answer, and need
        not be asked again for each shortest frame.
        """
        least = min((arbitration_key(ident, FrameFlag.EXTENDED if wide else 0) for ident, wide in sends), default=0)
        with self.lock:
            port = self._wire.open_port(node=answers, least_key=least)
            (self._nodes if answers else self._senders)[port] = node

    @property
    def _lives(self) -> bool:
        return bool(self._nodes or self._senders)

    def open_port(self) -> int:
        """Return the number of a new access to the bus, for `send` and `collect`."""
        with self.lock:
            return self._wire.open_port(node=False)

    def close_port(self, port: int) -> None:
        """Leave the bus; what is still queued is not sent."""
        with self.lock:
            self._wire.close_port(port)

    def send(self, port: int, frames: FrameBlock) -> None:
        """Hand frames to the port's transmitter now, in order.

        Their stamps are not looked at.

        Raises BenchFault, and queues none, where this bus cannot carry one of them.
        """
        with self.lock:
            self._wire.enqueue(port, frames, self._now, self._now, at_once=True)

    def collect(self, port: int) -> FrameBlock:
        """Return what the port has seen since the last call.

        Its own frames are flagged `SENT`.
        """
        with self.lock:
            return self._wire.collect(port)

    def health(self, port: int) -> BusHealth:
        """Return what the port's own bus controller knows."""
        with self.lock:
            return self._wire.health(port, self._now)

    def _before_arrival(self, until_ns: int) -> int:
        arrival = self._injection.next_arrival_ns
        return until_ns if arrival is None else min(until_ns, arrival)


# A network lives as long as somebody holds it: a bus, or the bench that attached nodes to it.
_NETWORKS: WeakValueDictionary[str, VirtualNetwork] = WeakValueDictionary()


def network_names() -> list[str]:
    """Return the names of the networks that are alive in this process."""
    return sorted(_NETWORKS)


def named_network(
    name: str, bitrate: int = 500_000, data_bitrate: int = 2_000_000, *, fd: bool = False
) -> VirtualNetwork:
    """Return the network of that name in this process, or create it.

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
                remedy="open all its buses with the same settings, or choose another channel name",
            )
        )
    return network
