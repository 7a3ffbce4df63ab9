"""The deterministic bus as an interface of python-can.

`can.Bus(interface="etb_virtual", channel="bench")` opens it.

Time stands still until somebody receives with a timeout or sleeps on the network's clock, so one thread can play all
parts. Receiving returns as soon as a frame ended on the bus, with the virtual time at which it did.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

import can

from etb_hil.base.errors import EtbHilError
from etb_hil.canio.bus.health import BusState
from etb_hil.canio.bus.virtual_network import named_network, network_names
from etb_hil.canio.messages import from_messages, to_message

if TYPE_CHECKING:
    from can.typechecking import AutoDetectedConfig, CanFilters

_STATES = {
    BusState.ERROR_ACTIVE: can.BusState.ACTIVE,
    BusState.ERROR_PASSIVE: can.BusState.PASSIVE,
    BusState.BUS_OFF: can.BusState.ERROR,
}


class VirtualBus(can.BusABC):
    """One access to a virtual network.

    `channel` is the network's name within the process.

    `bitrate` and `data_bitrate` in bit/s; `fd` allows FD frames; with `receive_own_messages` sent frames come back with
    the time at which they ended on the bus. Errors are python-can's: CanInitializationError, CanOperationError.
    """

    def __init__(
        self,
        channel: str,
        bitrate: int = 500_000,
        data_bitrate: int = 2_000_000,
        fd: bool = False,
        receive_own_messages: bool = False,
        can_filters: CanFilters | None = None,
    ) -> None:
        try:
            self.network = named_network(channel, bitrate, data_bitrate, fd=fd)
            self._port = self.network.open_port()
        except EtbHilError as error:
            raise can.CanInitializationError(str(error)) from None
        self.channel = channel
        self.channel_info = f"etb_virtual channel {channel}"
        self.receive_own_messages = receive_own_messages
        self._can_protocol = can.CanProtocol.CAN_FD if fd else can.CanProtocol.CAN_20
        self._inbox: deque[can.Message] = deque()
        super().__init__(channel=channel, can_filters=can_filters)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Return the next frame, or None after `timeout` seconds of virtual time.

        None waits for ever.

        Raises CanOperationError where nobody is left who could send while it waits for ever.
        """
        self._check_open()
        network = self.network
        with network.lock:
            deadline = None if timeout is None else network.now_ns() + round(timeout * 1e9)
            while not self._take():
                if deadline is not None and network.now_ns() >= deadline:
                    return None
                if deadline is None and network.idle:
                    raise can.CanOperationError(
                        "this would wait for ever: nobody on the virtual bus has a frame to send"
                    )
                network.step_to_delivery(deadline)
            return self._inbox.popleft()

    def _take(self) -> bool:
        frames = self.network.collect(self._port)
        for row in range(len(frames)):
            message = to_message(frames, row)
            if not message.is_rx and not self.receive_own_messages:
                continue
            message.channel = self.channel
            if self._matches_filters(message):
                self._inbox.append(message)
        return bool(self._inbox)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002 (python-can's signature)
        """Hand a message to the transmitter.

        The message leaves when virtual time passes, so that `timeout` has no meaning.
        """
        self._check_open()
        try:
            self.network.send(self._port, from_messages([msg]))
        except EtbHilError as error:
            raise can.CanOperationError(str(error)) from None

    @property
    def state(self) -> can.BusState:
        """The state of this port's bus controller; bus-off is `BusState.ERROR`."""
        return _STATES[self.network.health(self._port).state or BusState.ERROR_ACTIVE]

    @state.setter
    def state(self, new_state: can.BusState) -> None:
        raise NotImplementedError("the state follows from the error counters (ISO 11898-1)")

    def shutdown(self) -> None:
        """Leave the bus; what is still queued is not sent."""
        if not self._is_shutdown:
            self.network.close_port(self._port)
        super().shutdown()

    def _check_open(self) -> None:
        if self._is_shutdown:
            raise can.CanOperationError("the bus is closed")

    @staticmethod
    def _detect_available_configs() -> list[AutoDetectedConfig]:
        return [{"interface": "etb_virtual", "channel": name} for name in network_names()]
