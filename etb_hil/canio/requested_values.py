"""Readings of data identifiers, found in the frames of a bus or a log.

The decoder listens and asks nothing.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.canio.frames import FrameBlock, FrameFlag
from etb_hil.canio.isotp import IsoTpEnd, TransportError
from etb_hil.recording.samples import LOSS_UNKNOWN, SampleBlock

if TYPE_CHECKING:
    from etb_hil.canio.data_identifiers import DataIdentifier, RequestedValues

READ, RESPONSE, NEGATIVE, PENDING = 0x22, 0x62, 0x7F, 0x78
MISSED = 3  # times the usual distance of two readings: some are missing then


class RequestedValuesDecoder:
    """Turn requests, responses and periodic frames into samples.

    Requests are 0x22, periodic frames 0x2A; each identifier is a source.

    A value that was asked for was taken between request and response: its time is the middle, and half the distance is
    how far the time may be off (`half_ns`). A value that came by itself has the stamp of its frame. Samples do not
    depend on how the frames were cut into blocks.
    """

    def __init__(self, requested: RequestedValues) -> None:
        self._requested = requested
        self._by_number = {one.number: one for one in requested.identifiers}
        self._idents = np.array([i for i in (requested.request, requested.response, requested.periodic) if i], np.int64)
        self._request, self._response = IsoTpEnd(), IsoTpEnd()
        self._asked_ns: int | None = None
        self._answered_ns = 0
        self._last_ns: dict[str, int] = {}
        self._found: dict[str, list[tuple[int, float, bool]]] = {}
        self.times_ns: dict[str, list[int]] = {one.role: [] for one in requested.identifiers}
        self.half_ns: dict[str, list[int]] = {one.role: [] for one in requested.identifiers}

    def push(self, frames: FrameBlock) -> list[SampleBlock]:
        """Take frames in the order of their arrival.

        Return the readings that they brought, a block an identifier.
        """
        requested = self._requested
        for index in np.flatnonzero(np.isin(frames.ident, self._idents)):
            flags = int(frames.flags[index])
            is_extended = bool(flags & FrameFlag.EXTENDED)
            if is_extended != requested.extended or flags & (FrameFlag.REMOTE | FrameFlag.ERROR):
                continue
            stamp_ns, ident = int(frames.stamp_ns[index]), int(frames.ident[index])
            data = frames.data[index, : min(int(frames.length[index]), 8)].tobytes()
            if ident == requested.periodic:
                self._take_periodic(stamp_ns, data)
            elif ident == requested.request:
                self._take_request(stamp_ns, data)
            else:
                self._take_response(stamp_ns, data)
        found, self._found = self._found, {}
        return [_block(self._by_role(role).source, role, readings) for role, readings in found.items()]

    def _take_request(self, stamp_ns: int, data: bytes) -> None:
        _take(self._request, stamp_ns, data)
        while self._request.received:
            payload = self._request.received.popleft()
            self._asked_ns = stamp_ns if payload[0] == READ else None

    def _take_response(self, stamp_ns: int, data: bytes) -> None:
        if data and data[0] >> 4 in {0, 1}:  # the frame with which the answer begins
            self._answered_ns = stamp_ns
        _take(self._response, stamp_ns, data)
        while self._response.received:
            payload = self._response.received.popleft()
            if payload[0] == NEGATIVE and payload[-1] == PENDING:
                continue
            asked_ns, self._asked_ns = self._asked_ns, None
            if payload[0] == RESPONSE and asked_ns is not None:
                half_ns = max(self._answered_ns - asked_ns, 0) // 2
                self._take_values(payload[1:], asked_ns + half_ns, half_ns)

    def _take_values(self, data: bytes, time_ns: int, half_ns: int) -> None:
        found = []
        while len(data) >= 2:
            one = self._by_number.get(int.from_bytes(data[:2], "big"))
            if one is None or len(data) < 2 + one.length:
                return  # of unknown length: nobody knows where the next one begins
            found.append((one, data[2 : 2 + one.length]))
            data = data[2 + one.length :]
        if not data:  # a response of a wrong length brings nothing
            for one, value in found:
                self._note(one, time_ns, half_ns, one.value(value))

    def _take_periodic(self, stamp_ns: int, data: bytes) -> None:
        one = self._by_number.get(0xF200 | data[0]) if data else None
        if one is not None and one.rate and len(data) >= 1 + one.length:
            self._note(one, stamp_ns, 0, one.value(data[1 : 1 + one.length]))

    def _note(self, one: DataIdentifier, time_ns: int, half_ns: int, value: float) -> None:
        last_ns = self._last_ns.get(one.role)
        if last_ns is not None and time_ns <= last_ns:
            return
        is_gap = last_ns is not None and time_ns - last_ns > MISSED * one.every_ns
        self._last_ns[one.role] = time_ns
        self.times_ns[one.role].append(time_ns)
        self.half_ns[one.role].append(half_ns)
        self._found.setdefault(one.role, []).append((time_ns, value, is_gap))

    def _by_role(self, role: str) -> DataIdentifier:
        return next(one for one in self._by_number.values() if one.role == role)


def _take(end: IsoTpEnd, stamp_ns: int, data: bytes) -> None:
    with suppress(TransportError):  # who asked says what is wrong
        end.take(stamp_ns, data)
    with suppress(TransportError):
        end.step(stamp_ns)  # its flow control belongs to the one who asked


def _block(source: str, role: str, readings: list[tuple[int, float, bool]]) -> SampleBlock:
    time_ns = np.array([time for time, _, _ in readings], np.int64)
    values = np.array([value for _, value, _ in readings])
    lost = np.array([LOSS_UNKNOWN if is_gap else 0 for _, _, is_gap in readings], np.int64)
    return SampleBlock(source, time_ns, time_ns, {role: values}, lost)
