"""The virtual controller's UDS server: frames in and frames out.

The server works at control ticks of the controller's own time.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from udsoncan.ResponseCode import ResponseCode

from etb_hil.canio.frames import FrameBlock, FrameFlag
from etb_hil.canio.isotp import IsoTpEnd, TransportError, TransportTiming
from etb_hil.canio.requested_values import NEGATIVE
from etb_hil.controller.state import CONTROL_NS
from etb_hil.controller.uds.faults import UdsFault, UdsFaultKind
from etb_hil.controller.uds.learn_stops import LearnStops
from etb_hil.controller.uds.services import DEFAULT_SESSION, Refused, Services

if TYPE_CHECKING:
    from etb_hil.controller.machine import Machine
    from etb_hil.plant.values import ThrottleParameters
    from etb_hil.uds.settings import UdsSettings

EARLY = 0.6  # of P2 and P2*: when 'response pending' goes out, so that it is there in time
SECOND_TESTER_NS = 200_000_000  # from one request of a second tester to the next
BLOCK_SIZE = 8  # frames between two flow controls


class UdsServer:
    """Answers on `settings.request`.

    `texts` are what its data identifiers say, `faults` what goes wrong.

    It does something at control ticks alone, so that how time is cut into calls changes nothing.
    """

    def __init__(
        self,
        settings: UdsSettings,
        machine: Machine,
        nominal: ThrottleParameters,
        texts: Mapping[str, str],
        faults: tuple[UdsFault, ...] = (),
    ) -> None:
        learn_stops = LearnStops(machine, nominal)
        said = {identifier: texts[name] for name, identifier in settings.identification.items() if name in texts}
        requested = settings.requested()
        values = {} if requested is None else {one.number: one for one in requested.identifiers}
        self._services = Services(settings, machine, said, values, learn_stops)
        self._start_ns = machine.start_ns
        self._second_tester_ns = machine.start_ns
        self._learn_stops = learn_stops
        self._settings = settings
        self._faults = faults
        self._end = IsoTpEnd(
            TransportTiming(consecutive_ns=round(settings.timing.frames * 1e9), block_size=BLOCK_SIZE), settings.padding
        )
        self._arrived: list[tuple[int, bytes]] = []
        self._request = b""  # that is being worked on
        self._ready_ns = 0
        self._pending_ns = 0
        self._begun_ns = 0

    @property
    def is_extended(self) -> bool:
        """Whether its identifiers have 29 bits."""
        return self._settings.extended

    @property
    def sends(self) -> list[tuple[int, bool]]:
        """The identifiers of its frames, and whether they are extended."""
        settings = self._settings
        second_tester = settings.request if self._faults_of(UdsFaultKind.SECOND_TESTER) else None
        idents = (settings.response, settings.periodic, second_tester)
        return [(ident, settings.extended) for ident in idents if ident is not None]

    def take(self, frames: FrameBlock) -> None:
        """Take what came from the bus; frames of other identifiers are passed over."""
        for index in np.flatnonzero(frames.ident == self._settings.request):
            flags = int(frames.flags[index])
            is_extended = bool(flags & FrameFlag.EXTENDED)
            if is_extended == self._settings.extended and not flags & (FrameFlag.REMOTE | FrameFlag.ERROR):
                data = frames.data[index, : min(int(frames.length[index]), 8)].tobytes()
                self._arrived.append((int(frames.stamp_ns[index]), data))

    def next_ns(self, tick_ns: int) -> int | None:
        """Return the first control tick from `tick_ns` on at which it has something to do.

        None where it rests.
        """
        busy = (
            self._faults_of(UdsFaultKind.SECOND_TESTER)
            or self._request
            or self._end.is_sending
            or self._end.is_receiving
            or self._learn_stops.is_running
        )
        if busy or self._services.access.session != DEFAULT_SESSION:
            return tick_ns
        if not self._arrived:
            return None
        late = self._arrived[0][0] - tick_ns
        return tick_ns + max(-(-late // CONTROL_NS), 0) * CONTROL_NS

    def act(self, now_ns: int) -> tuple[list[tuple[int, list[bytes]]], list[float] | None]:
        """Do what is due at a control tick.

        Return frames by identifier, and a command to the machine.
        """
        while self._arrived and self._arrived[0][0] <= now_ns:
            stamp_ns, data = self._arrived.pop(0)
            self._hear(stamp_ns, data)
        access = self._services.access
        if access.session != DEFAULT_SESSION and now_ns > access.ends_ns:
            self._services.end_session()
            if self._learn_stops.is_running:
                self._learn_stops.stop()
        if self._request:
            self._work(now_ns)
        try:
            frames = self._end.step(now_ns)
        except TransportError:
            frames = []  # the tester is gone; whoever comes next begins anew
        out = [(self._settings.response, [self._spoilt(data, now_ns) for data in frames])]
        if self._settings.periodic is not None:
            out.append((self._settings.periodic, self._services.due(now_ns)))
        out.append((self._settings.request, self._asked_by_second_tester(now_ns)))
        return [(ident, data) for ident, data in out if data], self._learn_stops.step(now_ns)

    def _asked_by_second_tester(self, now_ns: int) -> list[bytes]:
        """Return the frame of a second tester, where there is one and it is due."""
        if now_ns < self._second_tester_ns or not self._has(UdsFaultKind.SECOND_TESTER, None, now_ns):
            return []
        self._second_tester_ns = now_ns + SECOND_TESTER_NS
        return [bytes.fromhex("023e00cccccccccc")]

    def _hear(self, stamp_ns: int, data: bytes) -> None:
        try:
            self._end.take(stamp_ns, data)
        except TransportError:
            return
        while self._end.received:
            request = self._end.received.popleft()
            if self._request or self._end.is_sending:  # one at a time: what comes meanwhile is dropped
                continue
            self._request, self._begun_ns, self._pending_ns = request, stamp_ns, stamp_ns
            lived_ns = stamp_ns - self._start_ns
            slow = sum(f.delay_ns for f in self._faults if f.strikes(UdsFaultKind.SLOW, request[0], lived_ns))
            self._ready_ns = stamp_ns + self._services.time_of(request[0]) + slow

    def _work(self, now_ns: int) -> None:
        """Answer the request once it is done, and say 'response pending' until then."""
        service, timing = self._request[0], self._settings.timing
        if self._has(UdsFaultKind.NO_ANSWER, service, now_ns):
            self._request = b""
            return
        endless = self._has(UdsFaultKind.PENDING_FOR_EVER, service, now_ns)
        if now_ns < self._ready_ns or endless:
            patience = timing.p2 if self._pending_ns == self._begun_ns else timing.p2_star
            due_ns = self._pending_ns + round(EARLY * patience * 1e9)
            if now_ns >= due_ns and not self._end.is_sending:
                self._pending_ns = now_ns
                self._end.send(bytes([NEGATIVE, service, ResponseCode.RequestCorrectlyReceived_ResponsePending]))
            return
        request, self._request = self._request, b""
        try:
            answer = self._services.answer(request, now_ns)
        except Refused as refused:
            answer = bytes([NEGATIVE, service, refused.code])
        if answer is None:
            return
        if self._has(UdsFaultKind.WRONG_LENGTH, service, now_ns):
            answer = answer[:2]
        if self._has(UdsFaultKind.WRONG_SERVICE, service, now_ns):
            answer = bytes([answer[0] ^ 0x01]) + answer[1:]
        self._end.send(answer)

    def _has(self, kind: UdsFaultKind, service: int | None, now_ns: int) -> bool:
        return any(fault.strikes(kind, service, now_ns - self._start_ns) for fault in self._faults)

    def _faults_of(self, kind: UdsFaultKind) -> bool:
        return any(fault.kind is kind for fault in self._faults)

    def _spoilt(self, data: bytes, now_ns: int) -> bytes:
        """Return a frame's data, with a wrong sequence number where that is the fault."""
        if data[0] >> 4 == 2 and self._has(UdsFaultKind.WRONG_SEQUENCE, None, now_ns):
            return bytes([data[0] & 0xF0 | (data[0] + 3) & 0xF]) + data[1:]
        return data
