"""The bench's end of UDS: requests out, responses in, with every wait bounded.

Messages are made and read by udsoncan; only their timing is ours, since time is handed in here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from udsoncan import Response
from udsoncan.ResponseCode import ResponseCode
from udsoncan.services import ReadDataByPeriodicIdentifier

from etb_hil.canio.frames import FrameBlock, FrameFlag, classic_frames
from etb_hil.canio.isotp import IsoTpEnd, TransportError, TransportTiming

if TYPE_CHECKING:
    from udsoncan import Request

    from etb_hil.uds.settings import UdsSettings

NEGATIVE = 0x7F
PERIODIC_BEGINS = b"\x6a"
_KINDS = {"N_TIMEOUT_Bs": "uds_no_answer", "N_TIMEOUT_Cr": "uds_no_answer"}


class UdsError(Exception):
    """Why a unit could not be asked: the reason's id, and the sentence for people."""

    def __init__(self, reason_id: str, text: str) -> None:
        super().__init__(text)
        self.reason_id = reason_id


class UdsClient:
    """One request at a time.

    `step` is to be called often, with every frame that was seen on the bus since.
    """

    def __init__(self, settings: UdsSettings) -> None:
        timing = settings.timing
        self._settings = settings
        frames_ns = round(timing.frames * 1e9)
        self._end = IsoTpEnd(TransportTiming(frames_ns, frames_ns), settings.padding)
        self._service: int | None = None  # of the request that waits for its response
        self._name = ""
        self._asked_ns = self._due_ns = 0
        self._p2_ns, self._p2_star_ns = (round((wait + timing.transport) * 1e9) for wait in (timing.p2, timing.p2_star))
        self._pending = 0

    def ask(self, request: Request, now_ns: int) -> None:
        """Begin to send a request.

        ValueError where the one before it still waits for its response.
        """
        if self._service is not None:
            raise ValueError("the request before it still waits for its response")
        payload = request.get_payload()
        self._end.reset()
        self._end.send(payload)
        self._service, self._name = payload[0], request.service.get_name() if request.service else hex(payload[0])
        self._asked_ns, self._due_ns, self._pending = now_ns, 0, 0

    @property
    def is_idle(self) -> bool:
        """Whether no request waits for its response."""
        return self._service is None

    def give_up(self) -> None:
        """Forget the request that waits."""
        self._end.reset()
        self._service = None

    def step(self, now_ns: int, frames: FrameBlock) -> tuple[FrameBlock | None, Response | None]:
        """Take the bus's frames.

        Return those to be sent, and the response where it has come.

        Raises UdsError where there is none in time, where it is none of this request, or somebody else asks the unit.
        """
        try:
            self._take(frames)
            response = self._response(now_ns)
            data = self._end.step(now_ns)
        except TransportError as error:
            text = f"{self._name}: {error} ({error.kind})"
            raise UdsError(_KINDS.get(error.kind, "uds_bad_answer"), text) from None
        if response is None and self._service is not None:
            self._require_in_time(now_ns)
        settings = self._settings
        out = classic_frames(now_ns, settings.request, data, extended=settings.extended) if data else None
        return out, response

    def _take(self, frames: FrameBlock) -> None:
        ours = (frames.ident == self._settings.request) | (frames.ident == self._settings.response)
        if not ours.any():
            return
        for index in np.flatnonzero(ours):
            flags = int(frames.flags[index])
            unlike = bool(flags & FrameFlag.EXTENDED) != self._settings.extended
            if unlike or flags & (FrameFlag.REMOTE | FrameFlag.ERROR):
                continue
            if int(frames.ident[index]) == self._settings.response:
                data = frames.data[index, : min(int(frames.length[index]), 8)].tobytes()
                self._end.take(int(frames.stamp_ns[index]), data)
            elif not flags & FrameFlag.SENT:
                raise UdsError(
                    "uds_second_tester",
                    f"another tester sends requests to the unit (identifier {self._settings.request:#x})",
                )

    def _response(self, now_ns: int) -> Response | None:
        """Return the final response to the request.

        The answer 'response pending' only moves the deadline.
        """
        while self._end.received:
            payload = self._end.received.popleft()
            if self._service is None:
                raise UdsError("uds_second_tester", "the unit answers what this bench did not ask")
            response = _response_of(payload)
            service = payload[1] if payload[0] == NEGATIVE and len(payload) > 1 else payload[0] - 0x40
            if not response.valid or service != self._service:
                shown = payload[:8].hex(" ")
                raise UdsError(
                    "uds_bad_answer", f"{self._name}: the unit answers with {shown}, which belongs to another request"
                )
            if not response.positive and response.code == ResponseCode.RequestCorrectlyReceived_ResponsePending:
                self._pending += 1
                self._due_ns = now_ns + self._p2_star_ns
                continue
            self._service = None
            return response
        return None

    def _require_in_time(self, now_ns: int) -> None:
        if self._end.is_sending or self._end.is_receiving:
            self._due_ns = max(self._due_ns, now_ns + self._p2_ns)  # the transport has its own time-outs
        elif self._due_ns == 0:
            self._due_ns = now_ns + self._p2_ns
        waited = (now_ns - self._asked_ns) * 1e-9
        if waited > self._settings.timing.longest:
            said = f"it said 'response pending' {self._pending} times" if self._pending else "its answer never ends"
            raise UdsError("uds_no_answer", f"{self._name}: the unit has not answered within {waited:.1f} s; {said}")
        if now_ns > self._due_ns:
            raise UdsError("uds_no_answer", f"{self._name}: the unit has not answered within {waited * 1e3:.0f} ms")


def _response_of(payload: bytes) -> Response:
    if payload == PERIODIC_BEGINS:  # udsoncan expects more of this service than the standard has it send
        return Response(ReadDataByPeriodicIdentifier, Response.Code.PositiveResponse, b"")
    return Response.from_payload(payload)
