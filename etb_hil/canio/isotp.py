"""ISO-TP (ISO 15765-2:2016), with the time handed in.

Messages of up to 4095 bytes go in classic CAN frames.

One object is one end of a connection. It never reads a clock: the same code runs in lock-step and at wall clock.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

LONGEST = 4095  # bytes of a message in classic frames without the escape sequence
_SINGLE, _FIRST, _CONSECUTIVE, _FLOW_CONTROL = range(4)
_CONTINUE, _WAIT, _OVERFLOW = range(3)
_LEAST_OF_FIRST = 8  # FF_DLmin of classic frames with normal addressing; of FD frames it is their length less 1
_MOST_WAITS = 10  # N_WFTmax: flow controls in a row that may say "wait"
_LONGEST_SEPARATION_NS = 127_000_000  # what a reserved STmin means (9.6.5.5)


class TransportError(Exception):
    """A message that cannot be received or sent.

    `kind` names the rule of ISO 15765-2 that was broken.
    """

    def __init__(self, kind: str, text: str) -> None:
        super().__init__(text)
        self.kind = kind


@dataclass(frozen=True, slots=True)
class TransportTiming:
    """Time-outs of one end in ns, and what it asks of the other.

    The end asks for a block size and a separation time (ms).
    """

    flow_control_ns: int = 1_000_000_000  # N_Bs
    consecutive_ns: int = 1_000_000_000  # N_Cr
    block_size: int = 0
    separation_ms: int = 0


class IsoTpEnd:
    """One end of an ISO-TP connection with normal addressing.

    Frames are padded to 8 bytes with `padding`.
    """

    def __init__(self, timing: TransportTiming = TransportTiming(), padding: int = 0xCC) -> None:
        self._timing = timing
        self._padding = padding
        self._out: deque[bytes] = deque()  # frames that go out at the next step
        self.received: deque[bytes] = deque()
        # the message that comes in
        self._into: bytearray | None = None
        self._length = 0
        self._sequence = 0
        self._block_left = 0
        self._due_in_ns = 0
        # the message that goes out
        self._rest = b""
        self._next_sequence = 0
        self._awaits_flow_control = False
        self._due_flow_ns = 0
        self._waits = 0
        self._allowed = 0  # consecutive frames until the next flow control; -1: all
        self._separation_ns = 0
        self._next_out_ns = 0

    @property
    def is_receiving(self) -> bool:
        """Whether a message has begun to arrive."""
        return self._into is not None

    @property
    def is_sending(self) -> bool:
        """Whether a part of a message is still to be sent."""
        return bool(self._out or self._rest)

    def reset(self) -> None:
        """Give up what is being received or sent, and forget what was received."""
        self._into, self._rest, self._awaits_flow_control = None, b"", False
        self._out.clear()
        self.received.clear()

    def send(self, payload: bytes) -> None:
        """Begin to send a message.

        ValueError where it is empty, too long, or another one is under way.
        """
        if not 0 < len(payload) <= LONGEST:
            raise ValueError(f"a message must have 1 to {LONGEST} bytes (it has {len(payload)})")
        if self._rest:
            raise ValueError("the message before it is still being sent")
        if len(payload) <= 7:
            self._put(bytes([len(payload)]) + payload)
            return
        self._put(bytes([_FIRST << 4 | len(payload) >> 8, len(payload) & 0xFF]) + payload[:6])
        self._rest, self._next_sequence, self._waits = payload[6:], 1, 0
        self._awaits_flow_control, self._due_flow_ns = True, 0  # the time runs from when the frame goes out

    def take(self, now_ns: int, data: bytes) -> None:
        """Take a frame of the other end that ended at `now_ns`.

        Raises TransportError where the frame breaks a rule.
        """
        kind = data[0] >> 4 if data else -1
        if kind == _SINGLE:
            self._take_single(data)
        elif kind == _FIRST:
            self._take_first(now_ns, data)
        elif kind == _CONSECUTIVE:
            self._take_consecutive(now_ns, data)
        elif kind == _FLOW_CONTROL:
            self._take_flow_control(now_ns, data)
        # others are reserved, and ignored (9.6.1)

    def step(self, now_ns: int) -> list[bytes]:
        """Return the frames to be sent at `now_ns`.

        TransportError where the other end has been silent for too long.
        """
        if self._into is not None and now_ns > self._due_in_ns:
            self._into = None
            raise TransportError("N_TIMEOUT_Cr", "a message broke off: its next frame did not come in time")
        frames = list(self._out)
        self._out.clear()
        if self._awaits_flow_control:
            if self._due_flow_ns == 0:
                self._due_flow_ns = now_ns + self._timing.flow_control_ns
            elif now_ns > self._due_flow_ns:
                self._rest, self._awaits_flow_control = b"", False
                raise TransportError("N_TIMEOUT_Bs", "no flow control came for the first frame of a message")
        while self._rest and not self._awaits_flow_control and now_ns >= self._next_out_ns:
            frames.append(self._padded(bytes([_CONSECUTIVE << 4 | self._next_sequence]) + self._rest[:7]))
            self._rest = self._rest[7:]
            self._next_sequence = self._next_sequence + 1 & 0xF
            self._next_out_ns = now_ns + self._separation_ns
            self._allowed -= self._allowed > 0
            if self._allowed == 0 and self._rest:
                self._awaits_flow_control, self._due_flow_ns = True, now_ns + self._timing.flow_control_ns
        return frames

    def _take_single(self, data: bytes) -> None:
        length = data[0] & 0xF
        if not 0 < length < len(data):
            return  # of a length that no single frame has: ignored (9.6.2.2)
        self._into = None  # a new message ends the one before it (9.8.3)
        self.received.append(data[1 : 1 + length])

    def _take_first(self, now_ns: int, data: bytes) -> None:
        length = (data[0] & 0xF) << 8 | data[1] if len(data) == 8 else 0
        if length < _LEAST_OF_FIRST:
            return  # it would have fitted a single frame: ignored, without a flow control (9.6.3.2)
        self._into, self._length, self._sequence = bytearray(data[2:]), length, 1
        self._flow_control(now_ns)

    def _take_consecutive(self, now_ns: int, data: bytes) -> None:
        if self._into is None:
            return  # of nobody's message (9.8.3)
        if data[0] & 0xF != self._sequence:
            expected, self._into = self._sequence, None
            raise TransportError(
                "N_WRONG_SN", f"a frame of a message has sequence number {data[0] & 0xF} in place of {expected}"
            )
        self._into += data[1:]
        self._sequence = self._sequence + 1 & 0xF
        self._due_in_ns = now_ns + self._timing.consecutive_ns
        if len(self._into) >= self._length:
            self.received.append(bytes(self._into[: self._length]))
            self._into = None
        elif self._block_left == 1:
            self._flow_control(now_ns)
        elif self._block_left:
            self._block_left -= 1

    def _flow_control(self, now_ns: int) -> None:
        self._put(bytes([_FLOW_CONTROL << 4 | _CONTINUE, self._timing.block_size, self._timing.separation_ms]))
        self._block_left = self._timing.block_size
        self._due_in_ns = now_ns + self._timing.consecutive_ns

    def _take_flow_control(self, now_ns: int, data: bytes) -> None:
        if not self._awaits_flow_control or len(data) < 3:
            return
        status = data[0] & 0xF
        self._waits = self._waits + 1 if status == _WAIT else 0
        if status == _WAIT and self._waits <= _MOST_WAITS:
            self._due_flow_ns = now_ns + self._timing.flow_control_ns
        elif status == _CONTINUE:
            self._awaits_flow_control = False
            self._allowed = data[1] or -1
            self._separation_ns = separation_ns(data[2])
            self._next_out_ns = now_ns
        else:
            self._rest, self._awaits_flow_control = b"", False
            if status == _WAIT:
                raise TransportError("N_WFT_OVRN", f"the other end asked {_MOST_WAITS + 1} times to wait")
            if status == _OVERFLOW:
                raise TransportError("N_BUFFER_OVFLW", "the other end has no room for the message")
            raise TransportError("N_INVALID_FS", f"a flow control has the unknown status {status}")

    def _put(self, data: bytes) -> None:
        self._out.append(self._padded(data))

    def _padded(self, data: bytes) -> bytes:
        return data + bytes([self._padding]) * (8 - len(data))


def separation_ns(code: int) -> int:
    """Return what a byte STmin means in ns (ISO 15765-2, table 20)."""
    if code <= 0x7F:
        return code * 1_000_000
    return (code - 0xF0) * 100_000 if 0xF1 <= code <= 0xF9 else _LONGEST_SEPARATION_NS
