"""One side's access to a bus: frames out and in, and the bus's health.

The interface is the same whatever the bus is; frames are in columns.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from etb_hil.canio.bus.bus_settings import SOCKETCAN, VIRTUAL, BusSettings
from etb_hil.canio.bus.virtual_network import VirtualNetwork, named_network

if TYPE_CHECKING:
    from etb_hil.base.clock import Clock
    from etb_hil.base.rewinding import Mark
    from etb_hil.canio.bus.health import BusHealth
    from etb_hil.canio.frames import FrameBlock

MOST_AT_ONCE = 10_000  # frames taken in one call: a flooded bus must not hold the bench up for ever


class Link(Protocol):
    """One side's access to a bus.

    Every method raises BenchFault where the bus has gone away.
    """

    def send(self, frames: FrameBlock) -> None:
        """Hand frames to the transmitter now, in order; their stamps are not looked at."""
        ...

    def receive(self) -> FrameBlock:
        """Return all frames seen since the last call, in order of time.

        Those of this side are flagged `SENT`.
        """
        ...

    def health(self) -> BusHealth:
        """Return load, counts and error state of the bus as this side knows them."""
        ...

    def close(self) -> None:
        """Leave the bus."""
        ...


class VirtualLink:
    """A link straight into a virtual network, without python-can between."""

    def __init__(self, network: VirtualNetwork) -> None:
        self._network = network
        self._port = network.open_port()

    def send(self, frames: FrameBlock) -> None:
        """Hand frames to the transmitter now."""
        self._network.send(self._port, frames)

    @property
    def network(self) -> VirtualNetwork:
        """The network that the link is into."""
        return self._network

    def ahead(self, frames: FrameBlock, until_ns: int, mark: Mark) -> None:
        """Send frames at their stamps, and live until `until_ns`, as the network does."""
        self._network.ahead(self._port, frames, until_ns, mark)

    def receive(self) -> FrameBlock:
        """Return all frames since the last call, in virtual time at their end."""
        return self._network.collect(self._port)

    def health(self) -> BusHealth:
        """Return load, counts and error state."""
        return self._network.health(self._port)

    def close(self) -> None:
        """Leave the network; what is still queued is not sent."""
        self._network.close_port(self._port)


def virtual_network(settings: BusSettings) -> VirtualNetwork:
    """Return the virtual network that the settings name.

    Nodes can be attached to it, and its clock can be used.

    Raises InputError where it is open with other bit rates.
    """
    return named_network(settings.channel, int(settings.bitrate), int(settings.data_bitrate), fd=settings.fd)


def open_link(settings: BusSettings, clock: Clock) -> Link:
    """Open the bus that the settings name.

    `clock` stamps what the driver does not stamp; a virtual network has a clock of its own. Raises InputError where
    python-can knows no such interface, BenchFault where the bus cannot be opened.
    """
    if settings.interface == VIRTUAL:
        return VirtualLink(virtual_network(settings))
    if settings.interface == SOCKETCAN:
        from etb_hil.canio.bus.socketcan_link import SocketCanLink  # noqa: PLC0415 (does not exist on every platform)

        return SocketCanLink(settings, clock)
    from etb_hil.canio.bus.python_can_link import PythonCanLink  # noqa: PLC0415 (importing can is slow)

    return PythonCanLink(settings, clock)
