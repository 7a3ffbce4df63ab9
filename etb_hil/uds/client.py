"""The bench's end of UDS: requests out, responses in, with every wait bounded.

Messages are made and read by udsoncan; only their timing is ours, since time is handed in here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from udsoncan import Response
from udsoncan.ResponseCode import ResponseCode
from udsoncan.services import ReadDataByIdentifier, ReadDataByPeriodicIdentifier

from etb_hil.canio.frames import FrameBlock, FrameFlag, classic_frames
from etb_hil.canio.isotp import IsoTpEnd, TransportError, TransportTiming
from etb_hil.canio.requested_values import NEGATIVE

if TYPE_CHECKING:
    from udsoncan import Request

    from etb_hil.uds.settings import UdsSettings

PERIODIC_BEGINS = b"\x6a"
_REPEAT_NS, _MOST_REPEATS = 100_000_000, 10  # of a request that a busy unit asks to repeat (NRC 0x21)
_PENDING = bytes([ResponseCode.RequestCorrectlyReceived_ResponsePending])
_ECHOED = {0x10: 1, 0x19: 1, 0x22: 2, 0x27: 1, 0x31: 3, 0x3E: 1}  # bytes that a positive response repeats, by service
_SUPPRESS = 0x80  # bit of a sub-function, which a response does not repeat
_KINDS = {"N_TIMEOUT_Bs": "uds_no_answer", "N_TIMEOUT_Cr": "uds_no_answer"}


class UdsError(Exception):
    """Why a unit could not be asked: the reason's id, and the sentence for people."""

    def __init__(self, reason_id: str, text: str) -> None:
        super().__init__(text)
        self.reason_id = reason_id


@dataclass(slots=True)
class _Asked:
    """What the response to a request is known by: the service, and what it repeats.

    `until_ns` is when it may still come.
    """

    service: int
    echo: bytes
    until_ns: int = 0

    def is_answered_by(self, payload: bytes) -> bool:
        """Return whether a response may be that to this request.

        A negative one repeats the service alone.
        """
        if payload[0] == NEGATIVE:
            return payload[1:2] == bytes([self.service])
        return payload[0] == self.service + 0x40 and payload[1:].startswith(self.echo)


class UdsClient:
    """One request at a time.

    `step` is to be called often, with every frame that was seen on the bus since.

    A unit that is slow or wakes up may answer a request that was given up. Such an answer is passed over for P2* from
    then on, the longest that ISO 14229-2 lets a unit take. It is a second tester's where no request explains it.
    """

    def __init__(self, settings: UdsSettings) -> None:
        timing = settings.timing
        self._settings = settings
        frames_ns = round(timing.frames * 1e9)
        self._end = IsoTpEnd(TransportTiming(frames_ns, frames_ns), settings.padding)
        self._service: int | None = None  # of the request that waits for its response
        self._asked = _Asked(0, b"")
        self._given_up: list[_Asked] = []
        self._now_ns = 0
        self._name = ""
        self._asked_ns = self._due_ns = 0
        self._p2_ns, self._p2_star_ns = (round((wait + timing.transport) * 1e9) for wait in (timing.p2, timing.p2_star))
        self._pending = self._repeats = 0
        self._payload = b""
        self._again_ns: int | None = None  # when it is repeated

    def ask(self, request: Request, now_ns: int) -> None:
        """Begin to send a request.

        ValueError where the one before it still waits for its response.
        """
        if self._service is not None:
            raise ValueError("the request before it still waits for its response")
        payload = request.get_payload()
        self._end.reset()
        self._end.send(payload)
        self._payload, self._again_ns, self._repeats = payload, None, 0
        self._service, self._name = payload[0], request.service.get_name() if request.service else hex(payload[0])
        self._asked = _Asked(payload[0], _echo_of(payload))
        self._now_ns = self._asked_ns = now_ns
        self._due_ns = self._pending = 0

    @property
    def is_idle(self) -> bool:
        """Whether no request waits for its response."""
        return self._service is None

    def give_up(self) -> None:
        """Give up the request that waits; a late answer to it is passed over."""
        self._end.reset()
        if self._service is not None:
            self._asked.until_ns = self._now_ns + self._p2_star_ns
            self._given_up = [*self._still_explained(self._now_ns), self._asked]
        self._service = None

    def step(self, now_ns: int, frames: FrameBlock) -> tuple[FrameBlock | None, Response | None]:
        """Take the bus's frames.

        Return those to be sent, and the response where it has come.

        Raises UdsError where there is none in time, where it is none of this request, or somebody else asks the unit.
        """
        self._now_ns = now_ns
        try:
            self._take(frames)
            response = self._response(now_ns)
            self._repeat(now_ns)
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
            is_ours = self._service is not None and self._asked.is_answered_by(payload)
            if not is_ours and self._is_late(payload, now_ns):
                continue
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
            if response.code == ResponseCode.BusyRepeatRequest and self._repeats < _MOST_REPEATS:
                self._again_ns = now_ns + _REPEAT_NS
                continue
            self._service = None
            return response
        return None

    def _repeat(self, now_ns: int) -> None:
        """Send the request again where a busy unit asked for that and it is due."""
        if self._service is not None and self._again_ns is not None and now_ns >= self._again_ns:
            self._again_ns, self._due_ns = None, 0
            self._repeats += 1
            self._end.send(self._payload)

    def _is_late(self, payload: bytes, now_ns: int) -> bool:
        """Return whether a response is that to a request that was given up.

        Each request explains one final response.
        """
        self._given_up = self._still_explained(now_ns)
        late = next((one for one in self._given_up if one.is_answered_by(payload)), None)
        if late is None:
            return False
        if payload[0] == NEGATIVE and payload[2:3] == _PENDING:
            late.until_ns = now_ns + self._p2_star_ns
        else:
            self._given_up.remove(late)
        return True

    def _still_explained(self, now_ns: int) -> list[_Asked]:
        return [one for one in self._given_up if now_ns <= one.until_ns]

    def _require_in_time(self, now_ns: int) -> None:
        if self._end.is_sending or self._end.is_receiving:
            self._due_ns = max(self._due_ns, now_ns + self._p2_ns)  # the transport has its own time-outs
        elif self._due_ns == 0:
            self._due_ns = now_ns + self._p2_ns
        if self._again_ns is not None:
            self._due_ns = max(self._due_ns, self._again_ns)  # nothing is on its way
        waited = (now_ns - self._asked_ns) * 1e-9
        if waited > self._settings.timing.longest:
            said = f"it said 'response pending' {self._pending} times" if self._pending else "its answer never ends"
            if self._repeats:
                said = f"it asked {self._repeats} times to repeat the request"
            raise UdsError("uds_no_answer", f"{self._name}: the unit has not answered within {waited:.1f} s; {said}")
        if now_ns > self._due_ns:
            raise UdsError("uds_no_answer", f"{self._name}: the unit has not answered within {waited * 1e3:.0f} ms")


def _echo_of(payload: bytes) -> bytes:
    """Return what a positive response to a request repeats of it."""
    echo = payload[1 : 1 + _ECHOED.get(payload[0], 0)]
    has_sub_function = payload[0] != ReadDataByIdentifier.request_id()
    return bytes([echo[0] & ~_SUPPRESS]) + echo[1:] if echo and has_sub_function else echo


def _response_of(payload: bytes) -> Response:
    if payload == PERIODIC_BEGINS:  # udsoncan expects more of this service than the standard has it send
        return Response(ReadDataByPeriodicIdentifier, Response.Code.PositiveResponse, b"")
    return Response.from_payload(payload)
