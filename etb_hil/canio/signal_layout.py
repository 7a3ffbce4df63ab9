"""Where the signals of one message lie, as tables of numbers, and the compiled functions that read and write them."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from etb_hil.base.errors import InputError, Problem

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cantools.database.can import Message, Signal
    from numpy.typing import NDArray

    Float64 = NDArray[np.float64]
    Int64 = NDArray[np.int64]
    Bytes = NDArray[np.uint8]
    Int = int | np.int64


class Overflow(IntEnum):
    """What is done with a value that the bits of its signal cannot hold."""

    REFUSE = 0
    SATURATE = 1
    WRAP = 2


_SATURATE, _WRAP = int(Overflow.SATURATE), int(Overflow.WRAP)

# Columns of the table of places. A signal is read from its most significant byte on, stepping +1 (Motorola) or -1
# (Intel); `_SHIFT` bits at the low end of the last byte belong to other signals.
_FIRST, _STEP, _BYTES, _SHIFT, _LENGTH, _SIGNED, _KIND, _SCALE, _OFFSET, _PARENT, _IDS, _ID_COUNT = range(12)
_PLACE = 12
# What the bits are: an integer scaled in float64; one whose scaling, or whose product with the scale, is exact in 64
# bits; floats. Integers whose scaled range is beyond 64 bits are rounded twice.
_LINEAR, _EXACT, _EXACT_PRODUCT, _FLOAT16, _FLOAT32, _FLOAT64 = range(6)


class SignalLayout:
    """The places and scalings of some signals of a message, and of the multiplexers that they hang on.

    Raises InputError where a signal does not lie inside its message.
    """

    def __init__(self, message: Message, names: Sequence[str]) -> None:
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
        self._order = np.argsort(_depth(self._places[:, _PARENT])[self.wanted], kind="stable")
        for index in self.wanted:
            _require_inside(message, message.signals[index], self._places[index])

    def decode(self, data: Bytes, rows: Int64) -> Float64:
        """Return the signals' values (s, n) in some rows of payloads uint8 (m, w), NaN where multiplexed out."""
        out = np.empty((len(self.wanted), len(rows)))
        if not data.flags.c_contiguous:
            data = np.ascontiguousarray(data)
        _decode(data, rows, self.wanted, self._places, self._factors, self._ids, out)
        return out

    def encode(self, values: Float64, overflow: Int64, out: Bytes) -> None:
        """Write values (s, n) into payloads uint8 (n, w) that are zero, each signal with its `Overflow` (s).

        Raises InputError for the first value that is refused.
        """
        k, row = _encode(values, self._order, self.wanted, overflow, self._places, self._factors, self._ids, out)
        if k >= 0:
            raise _refusal(self._message, self.names[k], float(values[k, row]))

    def place(self, k: int) -> Int64:
        """Return the place of one of the signals, as `raw_bits` takes it."""
        return self._places[self.wanted[k]]

    def half_floats(self) -> list[int]:
        """Return which of the signals are floats of 16 bits."""
        return [k for k, index in enumerate(self.wanted) if self._places[index, _KIND] == _FLOAT16]


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
        return {16: _FLOAT16, 32: _FLOAT32, 64: _FLOAT64}[signal.length], 1, 0
    scale, offset = signal.scale, signal.offset
    whole = float(scale).is_integer() and float(offset).is_integer()
    if whole or isinstance(scale, int):
        factor, shift = int(scale), int(offset) if whole else 0
        span = (-(1 << signal.length - 1), 1 << signal.length - 1) if signal.is_signed else (0, 1 << signal.length)
        if all(abs(raw * factor) + abs(shift) < 1 << 63 for raw in (*span, 1)):
            return (_EXACT if whole else _EXACT_PRODUCT), factor, shift
    return _LINEAR, 1, 0


def _depth(parents: Int64) -> Int64:
    """Return how many multiplexers stand above each signal: those above are written first."""
    depth = np.zeros(len(parents), np.int64)
    for index, above in enumerate(parents):
        parent = int(above)
        while parent >= 0:
            depth[index] += 1
            parent = int(parents[parent])
    return depth


def _require_inside(message: Message, signal: Signal, place: Int64) -> None:
    first, last = int(place[_FIRST]), int(place[_FIRST] + place[_STEP] * (place[_BYTES] - 1))
    if min(first, last) < 0 or max(first, last) >= message.length:
        raise InputError(
            Problem(
                f"the signal {message.name}.{signal.name} does not lie inside its message",
                value=f"bits up to byte {max(first, last)}",
                allowed=f"bytes 0 to {message.length - 1}",
                remedy="mend the DBC file",
            )
        )


def _refusal(message: Message, name: str, value: float) -> InputError:
    signal = message.get_signal_by_name(name)
    low = -(1 << signal.length - 1) if signal.is_signed else 0
    ends = sorted(raw * float(signal.scale) + float(signal.offset) for raw in (low, low + (1 << signal.length) - 1))
    return InputError(
        Problem(
            f"{message.name}.{name} cannot hold this value",
            value=value,
            allowed=f"{ends[0]:.9g} to {ends[1]:.9g} {signal.unit or ''}".rstrip(),
            remedy="keep the value inside the signal's range",
        )
    )


# The compiled functions take flat arrays, where a payload starts in its one (`start`), and where a signal's place does
# in its own (`at`): views of single rows cost more than reading the signal.


@njit(cache=True, error_model="numpy", forceinline=True)
def raw_bits(data: Bytes, start: Int, places: Int64, at: Int) -> np.uint64:
    """Return the bits of a signal as an unsigned integer."""
    position, step = start + places[at + _FIRST], places[at + _STEP]
    bits = np.uint64(0)
    for _ in range(places[at + _BYTES] - 1):
        bits = bits << np.uint64(8) | np.uint64(data[position])
        position += step
    shift = np.uint64(places[at + _SHIFT])
    bits = bits << (np.uint64(8) - shift) | np.uint64(data[position]) >> shift
    return np.uint64(bits & np.uint64(0xFFFFFFFFFFFFFFFF) >> np.uint64(64 - places[at + _LENGTH]))


@njit(cache=True, error_model="numpy", forceinline=True)
def signed_bits(data: Bytes, start: Int, places: Int64, at: Int) -> np.int64:
    """Return the bits of a signal as an integer with its sign."""
    bits = np.int64(raw_bits(data, start, places, at))
    room = 64 - places[at + _LENGTH]
    return np.int64((bits << room) >> room) if places[at + _SIGNED] else bits


@njit(cache=True, error_model="numpy")
def _is_active(data: Bytes, start: Int, places: Int64, at: Int, ids: Int64) -> bool:
    while places[at + _PARENT] >= 0:
        parent = places[at + _PARENT] * _PLACE
        switch = signed_bits(data, start, places, parent)
        first = places[at + _IDS]
        found = False
        for index in range(first, first + places[at + _ID_COUNT]):
            if ids[index] == switch:
                found = True
                break
        if not found:
            return False
        at = parent
    return True


@njit(cache=True, error_model="numpy")
def _half(bits: np.uint64) -> float:
    """Return the value of a 16-bit float."""
    word = np.int64(bits)
    exponent, fraction = word >> 10 & 0x1F, word & 0x3FF
    if exponent == 31:
        value = np.inf if fraction == 0 else np.nan
    elif exponent == 0:
        value = fraction * 2.0**-24
    else:
        value = (1024 + fraction) * 2.0**-25 * (1 << exponent)
    return -value if word >> 15 else value


@njit(cache=True, error_model="numpy", forceinline=True)
def _value_at(data: Bytes, start: Int, places: Int64, at: Int, scale: float, offset: float) -> float:
    kind = places[at + _KIND]
    if kind == _EXACT:
        return float(signed_bits(data, start, places, at) * places[at + _SCALE] + places[at + _OFFSET])
    if kind == _EXACT_PRODUCT:
        return float(signed_bits(data, start, places, at) * places[at + _SCALE]) + offset
    bits = raw_bits(data, start, places, at)
    if kind == _FLOAT64:
        raw = np.uint64(bits).view(np.float64)
    elif kind == _FLOAT32:
        raw = np.float64(np.uint32(bits).view(np.float32))
    elif kind == _FLOAT16:
        raw = np.float64(_half(bits))
    elif places[at + _SIGNED]:
        raw = np.float64(signed_bits(data, start, places, at))
    else:
        raw = np.float64(bits)
    return float(raw) * scale + offset


@njit(cache=True, error_model="numpy")
def read_value(payload: Bytes, place: Int64, scale: float, offset: float) -> float:
    """Return the value of a signal of one payload that no multiplexer leaves out."""
    return _value_at(payload, 0, place, 0, scale, offset)


@njit(cache=True, error_model="numpy")
def _decode(data: Bytes, rows: Int64, wanted: Int64, places: Int64, factors: Float64, ids: Int64, out: Float64) -> None:
    count, width = data.shape
    flat, table = data.reshape(count * width), places.reshape(places.size)
    for index in range(len(wanted)):
        at = wanted[index] * _PLACE
        scale, offset = factors[wanted[index], 0], factors[wanted[index], 1]
        multiplexed = table[at + _PARENT] >= 0
        for n in range(len(rows)):
            start = rows[n] * width
            if multiplexed and not _is_active(flat, start, table, at, ids):
                out[index, n] = np.nan
            else:
                out[index, n] = _value_at(flat, start, table, at, scale, offset)


@njit(cache=True, error_model="numpy", forceinline=True)
def _put(data: Bytes, start: Int, places: Int64, at: Int, bits: np.uint64) -> None:
    shift, step = np.uint64(places[at + _SHIFT]), places[at + _STEP]
    position = start + places[at + _FIRST] + step * (places[at + _BYTES] - 1)
    data[position] |= np.uint8((bits << shift) & np.uint64(0xFF))
    bits = bits >> (np.uint64(8) - shift)
    for _ in range(places[at + _BYTES] - 1):
        position -= step
        data[position] |= np.uint8(bits & np.uint64(0xFF))
        bits = bits >> np.uint64(8)


@njit(cache=True, error_model="numpy", forceinline=True)
def _integer_bits(raw: float, length: int, signed: int, overflow: int) -> tuple[np.uint64, bool]:
    """Return an integral value as the bits of a signal, and whether they hold it."""
    span = 2.0**length
    low = -0.5 * span if signed else 0.0
    high = low + span
    if overflow == _WRAP:
        raw -= np.floor((raw - low) / span) * span
    mask = np.uint64(0xFFFFFFFFFFFFFFFF) >> np.uint64(64 - length)
    inside = low <= raw < high
    if raw >= high:
        return (mask >> np.uint64(1) if signed else mask), overflow == _SATURATE
    if not inside:
        raw, inside = low, overflow == _SATURATE and raw < low
    if raw >= 2.0**63:
        return np.uint64(raw) & mask, inside
    return np.uint64(np.int64(raw)) & mask, inside


@njit(cache=True, error_model="numpy", forceinline=True)
def _write_at(
    data: Bytes, start: Int, places: Int64, at: Int, scale: float, offset: float, value: float, overflow: int
) -> bool:
    raw = (value - offset) / scale
    kind = places[at + _KIND]
    if kind == _FLOAT64:
        bits = np.float64(raw).view(np.uint64)
    elif kind == _FLOAT32:
        bits = np.uint64(np.float32(raw).view(np.uint32))
    elif kind == _FLOAT16:
        bits = np.uint64(value)  # the caller rounded it: numba has no 16-bit floats
    else:
        bits, held = _integer_bits(np.rint(raw), places[at + _LENGTH], places[at + _SIGNED], overflow)
        if not held:
            return False
    _put(data, start, places, at, bits)
    return True


@njit(cache=True, error_model="numpy")
def write_value(payload: Bytes, place: Int64, scale: float, offset: float, value: float, overflow: int) -> bool:
    """Write a signal's value into bits of one payload that are zero; False where they cannot hold it and stay zero."""
    return _write_at(payload, 0, place, 0, scale, offset, value, overflow)


@njit(cache=True, error_model="numpy")
def _encode(
    values: Float64,
    order: Int64,
    wanted: Int64,
    overflow: Int64,
    places: Int64,
    factors: Float64,
    ids: Int64,
    out: Bytes,
) -> tuple[int, int]:
    count, width = out.shape
    flat, table = out.reshape(count * width), places.reshape(places.size)
    for index in order:
        at = wanted[index] * _PLACE
        scale, offset = factors[wanted[index], 0], factors[wanted[index], 1]
        multiplexed = table[at + _PARENT] >= 0
        for n in range(count):
            start = n * width
            if multiplexed and not _is_active(flat, start, table, at, ids):
                continue
            if not _write_at(flat, start, table, at, scale, offset, values[index, n], overflow[index]):
                return index, n
    return -1, -1
