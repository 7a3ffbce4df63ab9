"""Signals in payloads: the compiled functions that read and write their bits."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.compiled import njit

if TYPE_CHECKING:
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
# (Intel); `SHIFT` bits at the low end of the last byte belong to other signals.
FIRST, STEP, BYTES, SHIFT, LENGTH, SIGNED, KIND, SCALE, OFFSET, PARENT, IDS, ID_COUNT = range(12)
PLACE = 12
# What the bits are: an integer scaled in float64; one whose scaling, or whose product with the scale, is exact in 64
# bits; floats. Integers whose scaled range is beyond 64 bits are rounded twice.
LINEAR, EXACT, EXACT_PRODUCT, FLOAT16, FLOAT32, FLOAT64 = range(6)

# The compiled functions take flat arrays, where a payload starts in its one (`start`), and where a signal's place does
# in its own (`at`): views of single rows cost more than reading the signal.


@njit(cache=True, error_model="numpy", forceinline=True)
def raw_bits(data: Bytes, start: Int, places: Int64, at: Int) -> np.uint64:
    """Return the bits of a signal as an unsigned integer."""
    position, step = start + places[at + FIRST], places[at + STEP]
    bits = np.uint64(0)
    for _ in range(places[at + BYTES] - 1):
        bits = bits << np.uint64(8) | np.uint64(data[position])
        position += step
    shift = np.uint64(places[at + SHIFT])
    bits = bits << (np.uint64(8) - shift) | np.uint64(data[position]) >> shift
    return np.uint64(bits & np.uint64(0xFFFFFFFFFFFFFFFF) >> np.uint64(64 - places[at + LENGTH]))


@njit(cache=True, error_model="numpy", forceinline=True)
def signed_bits(data: Bytes, start: Int, places: Int64, at: Int) -> np.int64:
    """Return the bits of a signal as an integer with its sign."""
    bits = np.int64(raw_bits(data, start, places, at))
    room = 64 - places[at + LENGTH]
    return np.int64((bits << room) >> room) if places[at + SIGNED] else bits


@njit(cache=True, error_model="numpy")
def _is_active(data: Bytes, start: Int, places: Int64, at: Int, ids: Int64) -> bool:
    while places[at + PARENT] >= 0:
        parent = places[at + PARENT] * PLACE
        switch = signed_bits(data, start, places, parent)
        first = places[at + IDS]
        found = False
        for index in range(first, first + places[at + ID_COUNT]):
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
    kind = places[at + KIND]
    if kind == EXACT:
        return float(signed_bits(data, start, places, at) * places[at + SCALE] + places[at + OFFSET])
    if kind == EXACT_PRODUCT:
        return float(signed_bits(data, start, places, at) * places[at + SCALE]) + offset
    bits = raw_bits(data, start, places, at)
    if kind == FLOAT64:
        raw = np.uint64(bits).view(np.float64)
    elif kind == FLOAT32:
        raw = np.float64(np.uint32(bits).view(np.float32))
    elif kind == FLOAT16:
        raw = np.float64(_half(bits))
    elif places[at + SIGNED]:
        raw = np.float64(signed_bits(data, start, places, at))
    else:
        raw = np.float64(bits)
    return float(raw) * scale + offset


@njit(cache=True, error_model="numpy")
def read_value(payload: Bytes, place: Int64, scale: float, offset: float) -> float:
    """Return the value of a signal of one payload that no multiplexer leaves out."""
    return _value_at(payload, 0, place, 0, scale, offset)


@njit(cache=True, error_model="numpy")
def read_signal(
    data: Bytes,
    width: int,
    rows: Int64,
    first: int,
    end: int,
    places: Int64,
    signal: int,
    factors: Float64,
    ids: Int64,
    out: Float64,
    into: int,
    step: int,
) -> None:
    """Write one signal's values in `rows[first:end]` to `out[into::step]`.

    Rows are payloads; values are NaN where multiplexed out.
    """
    at = signal * PLACE
    scale, offset = factors[signal, 0], factors[signal, 1]
    multiplexed = places[at + PARENT] >= 0
    for index in range(first, end):
        start = rows[index] * width
        if multiplexed and not _is_active(data, start, places, at, ids):
            out[into] = np.nan
        else:
            out[into] = _value_at(data, start, places, at, scale, offset)
        into += step


@njit(cache=True, error_model="numpy")
def decode_rows(
    data: Bytes, rows: Int64, wanted: Int64, places: Int64, factors: Float64, ids: Int64, out: Float64
) -> None:
    """Fill `out` (s, n) with the values of the signals `wanted` (s) in some rows.

    A value is NaN where it is multiplexed out.
    """
    count, width = data.shape
    flat, table, values = data.reshape(count * width), places.reshape(places.size), out.reshape(out.size)
    for index in range(len(wanted)):
        into = index * len(rows)
        read_signal(flat, width, rows, 0, len(rows), table, wanted[index], factors, ids, values, into, 1)


@njit(cache=True, error_model="numpy", forceinline=True)
def _put(data: Bytes, start: Int, places: Int64, at: Int, bits: np.uint64) -> None:
    shift, step = np.uint64(places[at + SHIFT]), places[at + STEP]
    position = start + places[at + FIRST] + step * (places[at + BYTES] - 1)
    data[position] |= np.uint8((bits << shift) & np.uint64(0xFF))
    bits = bits >> (np.uint64(8) - shift)
    for _ in range(places[at + BYTES] - 1):
        position -= step
        data[position] |= np.uint8(bits & np.uint64(0xFF))
        bits = bits >> np.uint64(8)


@njit(cache=True, error_model="numpy", forceinline=True)
def _integer_bits(raw: float, length: int, signed: int, overflow: int) -> tuple[np.uint64, bool]:
    """Return an integral value as the bits of a signal, and whether they hold it."""
    span = 2.0 * float(np.uint64(1) << np.uint64(length - 1))
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
def write_at(
    data: Bytes, start: Int, places: Int64, at: Int, scale: float, offset: float, value: float, overflow: int
) -> bool:
    """Write a signal's value into bits of a payload that are zero.

    False where they cannot hold it and stay zero.
    """
    raw = (value - offset) / scale
    kind = places[at + KIND]
    if kind == FLOAT64:
        bits = np.float64(raw).view(np.uint64)
    elif kind == FLOAT32:
        bits = np.uint64(np.float32(raw).view(np.uint32))
    elif kind == FLOAT16:
        bits = np.uint64(value)  # the caller rounded it: numba has no 16-bit floats
    else:
        bits, held = _integer_bits(np.rint(raw), places[at + LENGTH], places[at + SIGNED], overflow)
        if not held:
            return False
    _put(data, start, places, at, bits)
    return True


@njit(cache=True, error_model="numpy")
def encode_rows(
    values: Float64,
    order: Int64,
    wanted: Int64,
    overflow: Int64,
    places: Int64,
    factors: Float64,
    ids: Int64,
    out: Bytes,
) -> tuple[int, int]:
    """Write values (s, n) into payloads that are zero.

    Return signal and row of the first refused, or -1, -1.
    """
    count, width = out.shape
    flat, table = out.reshape(count * width), places.reshape(places.size)
    for index in order:
        at = wanted[index] * PLACE
        scale, offset = factors[wanted[index], 0], factors[wanted[index], 1]
        multiplexed = table[at + PARENT] >= 0
        for n in range(count):
            start = n * width
            if multiplexed and not _is_active(flat, start, table, at, ids):
                continue
            if not write_at(flat, start, table, at, scale, offset, values[index, n], overflow[index]):
                return index, n
    return -1, -1
