"""Where the signals of one message lie, as tables of numbers."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.canio.dbc import signal_bits as sb
from etb_hil.canio.dbc.dbc_file import require_plain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cantools.database.can import Message, Signal
    from numpy.typing import NDArray

    Float64 = NDArray[np.float64]
    Int64 = NDArray[np.int64]
    Bytes = NDArray[np.uint8]


_EXACT_BITS = 53  # of an integer in float64


class SignalLayout:
    """The places and scalings of some signals of a message.

    Those of the multiplexers that they hang on are there, too.

    Raises InputError where a signal does not lie inside its message, or two signals have one name.
    """

    def __init__(self, message: Message, names: Sequence[str]) -> None:
        require_plain(message)
        order = {signal.name: index for index, signal in enumerate(message.signals)}
        self.names = tuple(names)
        self._message = message
        self.wanted = np.array([order[name] for name in names], np.int64)
        self._places = np.zeros((len(order), 12), np.int64)
        self._factors = np.ones((len(order), 2))
        ids: list[int] = []
        for index, signal in enumerate(message.signals):
            parent = order[signal.multiplexer_signal] if signal.multiplexer_signal else -1
            chosen = list(signal.multiplexer_ids or []) if parent >= 0 else []
            self._places[index] = (*_place(signal), *_scaling(signal), parent, len(ids), len(chosen))
            self._factors[index] = float(signal.scale), float(signal.offset)
            ids += chosen
        self._ids = np.array(ids or [0], np.int64)
        self._order = np.argsort(_depth(self._places[:, sb.PARENT])[self.wanted], kind="stable")
        for index in self.wanted:
            _require_inside(message, message.signals[index], self._places[index])

    def decode(self, data: Bytes, rows: Int64) -> Float64:
        """Return the signals' values (s, n) in some rows of payloads uint8 (m, w).

        They are NaN where multiplexed out.
        """
        out = np.empty((len(self.wanted), len(rows)))
        if not data.flags.c_contiguous:
            data = np.ascontiguousarray(data)
        sb.decode_rows(data, rows, self.wanted, self._places, self._factors, self._ids, out)
        return out

    def encode(self, values: Float64, overflow: Int64, out: Bytes) -> None:
        """Write values (s, n) into payloads uint8 (n, w) that are zero.

        Each signal has its `Overflow` (s).

        Raises InputError for the first value that is refused.
        """
        k, row = sb.encode_rows(values, self._order, self.wanted, overflow, self._places, self._factors, self._ids, out)
        if k >= 0:
            raise _refusal(self._message, self.names[k], float(values[k, row]))

    def exceeds_float(self, k: int) -> bool:
        """Return whether one of the signals is an integer of more bits than float64 holds."""
        place = self.place(k)
        return bool(place[sb.LENGTH] > _EXACT_BITS and place[sb.KIND] not in (sb.FLOAT16, sb.FLOAT32, sb.FLOAT64))

    def encode_whole(self, k: int, values: Sequence[float], overflow: sb.Overflow, out: Bytes) -> None:
        """Write values (n) of one signal as they are in Python, integers to the last bit.

        Its bits in payloads (n, w) are zero before.

        Payloads that the signal is multiplexed out of keep theirs. Raises InputError for the first value refused.
        """
        signal, place = self._message.get_signal_by_name(self.names[k]), self.place(k)
        scale, offset = Fraction(signal.scale), Fraction(signal.offset)
        span = 1 << int(place[sb.LENGTH])
        low = -span // 2 if place[sb.SIGNED] else 0
        for value in values:
            if not math.isfinite(value):
                raise _refusal(self._message, self.names[k], value)
        raws = [round((Fraction(value) - offset) / scale) for value in values]
        for value, raw in zip(values, raws, strict=True):
            if overflow == sb.Overflow.REFUSE and not low <= raw < low + span:
                raise _refusal(self._message, self.names[k], value)
        if overflow == sb.Overflow.SATURATE:
            raws = [min(max(raw, low), low + span - 1) for raw in raws]
        rows = np.flatnonzero(~np.isnan(self.decode(out, np.arange(len(out)))[k]))
        bits = np.array([raws[row] % span for row in rows], np.uint64)
        shift, position = np.uint64(place[sb.SHIFT]), int(place[sb.FIRST] + place[sb.STEP] * (place[sb.BYTES] - 1))
        out[rows, position] |= (bits << shift).astype(np.uint8)
        bits >>= np.uint64(8) - shift
        for _ in range(int(place[sb.BYTES]) - 1):
            position -= int(place[sb.STEP])
            out[rows, position] |= bits.astype(np.uint8)
            bits >>= np.uint64(8)

    def place(self, k: int) -> Int64:
        """Return the place of one of the signals, as `raw_bits` takes it."""
        return self._places[self.wanted[k]]

    def tables(self, signals: int, ids: int) -> tuple[Int64, Float64, Int64]:
        """Return places, factors and multiplexer ids, behind those of other messages.

        There are so many of the latter.
        """
        places = self._places.copy()
        places[:, sb.PARENT] += np.where(places[:, sb.PARENT] >= 0, signals, 0)
        places[:, sb.IDS] += ids
        return places, self._factors, self._ids

    def half_floats(self) -> list[int]:
        """Return which of the signals are floats of 16 bits."""
        return [k for k, index in enumerate(self.wanted) if self._places[index, sb.KIND] == sb.FLOAT16]


def _place(signal: Signal) -> tuple[int, int, int, int, int, int]:
    start, length = signal.start, signal.length
    if signal.byte_order == "little_endian":
        first, last = (start + length - 1) // 8, start // 8
        return first, -1, first - last + 1, start % 8, length, int(signal.is_signed)
    head = start % 8 + 1
    count = 1 + max(0, -(-(length - head) // 8))
    return start // 8, 1, count, head + 8 * (count - 1) - length, length, int(signal.is_signed)


def _scaling(signal: Signal) -> tuple[int, int, int]:
    if signal.is_float:
        return {16: sb.FLOAT16, 32: sb.FLOAT32, 64: sb.FLOAT64}[signal.length], 1, 0
    scale, offset = signal.scale, signal.offset
    whole = float(scale).is_integer() and float(offset).is_integer()
    if whole or isinstance(scale, int):
        factor, shift = int(scale), int(offset) if whole else 0
        span = (-(1 << signal.length - 1), 1 << signal.length - 1) if signal.is_signed else (0, 1 << signal.length)
        if all(abs(raw * factor) + abs(shift) < 1 << 63 for raw in (*span, 1)):
            return (sb.EXACT if whole else sb.EXACT_PRODUCT), factor, shift
    return sb.LINEAR, 1, 0


def _depth(parents: Int64) -> Int64:
    """Return how many multiplexers stand above each signal.

    Those above are written first.
    """
    depth = np.zeros(len(parents), np.int64)
    for index, above in enumerate(parents):
        parent = int(above)
        while parent >= 0:
            depth[index] += 1
            parent = int(parents[parent])
    return depth


def _require_inside(message: Message, signal: Signal, place: Int64) -> None:
    first, last = int(place[sb.FIRST]), int(place[sb.FIRST] + place[sb.STEP] * (place[sb.BYTES] - 1))
    if min(first, last) < 0 or max(first, last) >= message.length:
        raise InputError(
            Problem(
                f"the signal {message.name}.{signal.name} does not lie inside its message",
                value=f"bits up to byte {max(first, last)}",
                allowed=f"bytes 0 to {message.length - 1}",
                remedy="correct the DBC file",
            )
        )


def _refusal(message: Message, name: str, value: float) -> InputError:
    signal = message.get_signal_by_name(name)
    low = -(1 << signal.length - 1) if signal.is_signed else 0
    scale, offset = Fraction(signal.scale), Fraction(signal.offset)
    ends = sorted(raw * scale + offset for raw in (low, low + (1 << signal.length) - 1))
    first, last = (str(end) if end.denominator == 1 else f"{float(end):.9g}" for end in ends)
    return InputError(
        Problem(
            f"{message.name}.{name} cannot hold this value",
            value=value,
            allowed=f"{first} to {last} {signal.unit or ''}".rstrip(),
            remedy="keep the value inside the signal's range",
        )
    )
