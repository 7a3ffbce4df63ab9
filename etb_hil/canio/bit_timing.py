"""Time of a frame on the wire.

Every bit of it counts, the stuffed bits that its content causes included.

Lengths follow ISO 11898-1:2015. With a bit rate switch, the bits from ESI to the CRC delimiter are counted at the data
rate. The switch itself lies at a sample point inside BRS and back inside the CRC delimiter; what is cut off one bit is
added to the other, so that counting whole bits is off by less than one data bit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.canio.frames import FD_LENGTHS, FrameFlag

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from etb_hil.canio.frames import FrameBlock

INTERMISSION_BITS = 3
# Error flag, error delimiter and intermission: the shortest error frame, where all nodes see the error together.
ERROR_FRAME_BITS = 6 + 8 + INTERMISSION_BITS

_EXTENDED = int(FrameFlag.EXTENDED)
_REMOTE = int(FrameFlag.REMOTE)
_ERROR = int(FrameFlag.ERROR)
_FD = int(FrameFlag.FD)
_BRS = int(FrameFlag.BITRATE_SWITCH)
_ESI = int(FrameFlag.ERROR_STATE)

_CRC15 = 0x4599  # polynomial of classic frames (ISO 11898-1)
_TAIL = 1 + 1 + 7 + INTERMISSION_BITS  # acknowledge slot and delimiter, end of frame, intermission
_LONG_FD = 16  # payloads beyond it carry CRC-21 in place of CRC-17


def _stuffing_tables() -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return the next state and the stuff bits for (state, byte).

    State = 5 * last bit + run length - 1.

    A stuff bit is counted with the bit that follows it, because one that is due at the end of the dynamically stuffed
    part of an FD frame is left out: the fixed stuff bit stands in its place.
    """
    follow = np.zeros((10, 256), np.uint8)
    stuffed = np.zeros((10, 256), np.uint8)
    for start in range(10):
        for byte in range(256):
            state = start
            for shift in range(7, -1, -1):
                state, added = _step(state, byte >> shift & 1)
                stuffed[start, byte] += added
            follow[start, byte] = state
    return follow, stuffed


def _step(state: int, bit: int) -> tuple[int, int]:
    last, run = state // 5, state % 5
    if run == 4:
        last, run = 1 - last, 0
        return (5 * last + 1 if bit == last else 5 * bit), 1
    return (state + 1 if bit == last else 5 * bit), 0


def _crc15_table() -> NDArray[np.uint16]:
    table = np.zeros(256, np.uint16)
    for byte in range(256):
        crc = byte << 7
        for _ in range(8):
            crc = (crc << 1) ^ (_CRC15 if crc & 0x4000 else 0)
        table[byte] = crc & 0x7FFF
    return table


_FOLLOW, _STUFFED = _stuffing_tables()
_FOLLOW_BIT = np.array([[_step(s, b)[0] for b in (0, 1)] for s in range(10)], np.uint8)
_STUFFED_BIT = np.array([[_step(s, b)[1] for b in (0, 1)] for s in range(10)], np.uint8)
_CRC15_TABLE = _crc15_table()
_DLC_OF_LENGTH = np.array([next(d for d, n in enumerate(FD_LENGTHS) if n >= length) for length in range(65)], np.uint8)
_LENGTH_OF_DLC = np.array(FD_LENGTHS, np.uint8)


def frame_bits(block: FrameBlock) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the bits of each frame at the nominal rate (n) and data rate (n).

    The 3 of intermission are included.

    An FD payload of a length that no DLC has is counted with its padding zeros. An error frame counts
    `ERROR_FRAME_BITS`. Source: ISO 11898-1:2015, frame formats and bit stuffing.
    """
    nominal = np.empty(len(block), np.int64)
    data = np.empty(len(block), np.int64)
    _frame_bits(block.ident, block.flags, block.length, np.ascontiguousarray(block.data), nominal, data)
    return nominal, data


def worst_case_bits(length: int, *, extended: bool, fd: bool, bitrate_switch: bool) -> tuple[int, int]:
    """Return an upper bound of the bits at the nominal and at the data rate.

    The bound holds for any payload of `length` bytes.

    Source: Davis, Burns, Bril, Lukkien 2007 for classic frames; the same argument for FD frames.
    """
    if not fd:
        stuffable = (54 if extended else 34) + 8 * length
        return stuffable + (stuffable - 1) // 4 + 1 + _TAIL, 0
    payload = FD_LENGTHS[_DLC_OF_LENGTH[length]]
    arbitration = 36 if extended else 17
    crc = 1 + (4 + 21 + 7 if payload > _LONG_FD else 4 + 17 + 6)
    rest = 5 + 8 * payload
    if not bitrate_switch:
        dynamic = arbitration + rest
        return dynamic + (dynamic - 2) // 4 + crc + _TAIL, 0
    # FDF, res and BRS alternate: no run of five reaches over them.
    head = arbitration + (arbitration - 4) // 4
    return head + _TAIL, rest + (rest - 1) // 4 + crc


@njit(cache=True, error_model="numpy")
def _frame_bits(
    ident: NDArray[np.uint32],
    flags: NDArray[np.uint8],
    length: NDArray[np.uint8],
    data: NDArray[np.uint8],
    nominal: NDArray[np.int64],
    data_rate: NDArray[np.int64],
) -> None:
    count, width = data.shape
    flat = data.reshape(count * width)
    for row in range(len(ident)):
        nominal[row], data_rate[row] = one_frame_bits(ident[row], flags[row], length[row], flat, row * width, width)


@njit(cache=True, error_model="numpy")
def one_frame_bits(
    ident: np.uint32, flags: np.uint8, length: np.uint8, data: NDArray[np.uint8], start: int, width: int
) -> tuple[np.int64, np.int64]:
    """Return what `frame_bits` returns of one frame, for other kernels.

    `data` is flat, and holds the payload of `width` bytes from `start` on: a view of one row costs more than its bits.
    """
    flag, size = np.int64(flags), np.int64(length)
    if flag & _ERROR:
        return np.int64(ERROR_FRAME_BITS), np.int64(0)
    if flag & _FD:
        return _fd_bits(np.int64(ident), flag, size, data, start, width)
    return _classic_bits(np.int64(ident), flag, size, data, start), np.int64(0)


@njit(cache=True, error_model="numpy")
def _arbitration(ident: np.int64, extended: bool, remote: np.int64) -> tuple[np.int64, np.int64]:
    """Return the bits from SOF to IDE (base) or RTR (extended), and how many they are."""
    if extended:
        return ((ident >> 18) & 0x7FF) << 21 | 3 << 19 | (ident & 0x3FFFF) << 1 | remote, np.int64(33)
    return (ident & 0x7FF) << 2 | remote << 1, np.int64(14)


@njit(cache=True, error_model="numpy")
def _classic_bits(ident: np.int64, flag: np.int64, length: np.int64, data: NDArray[np.uint8], start: int) -> np.int64:
    remote = np.int64(1 if flag & _REMOTE else 0)
    extended = (flag & _EXTENDED) != 0
    word, count = _arbitration(ident, extended, remote)
    reserved = 2 if extended else 1
    word = word << (reserved + 4) | min(length, np.int64(15))
    count += reserved + 4
    state, stuffed, crc = np.int64(0), np.int64(0), np.int64(0)  # the state after SOF, the first dominant bit
    for shift in range(count - 2, -1, -1):
        bit = word >> shift & 1
        stuffed += np.int64(_STUFFED_BIT[state, bit])
        state = np.int64(_FOLLOW_BIT[state, bit])
        crc = (crc << 1 & 0x7FFF) ^ np.int64(_CRC15 if crc >> 14 != bit else 0)
    payload = np.int64(0) if remote else min(length, np.int64(8))
    for column in range(payload):
        byte = data[start + column]
        stuffed += np.int64(_STUFFED[state, byte])
        state = np.int64(_FOLLOW[state, byte])
        crc = (crc << 8 & 0x7FFF) ^ np.int64(_CRC15_TABLE[(crc >> 7 ^ byte) & 0xFF])
    for shift in range(14, -1, -1):
        bit = crc >> shift & 1
        stuffed += np.int64(_STUFFED_BIT[state, bit])
        state = np.int64(_FOLLOW_BIT[state, bit])
    if state % 5 == 4:
        stuffed += 1
    return count + 8 * payload + 15 + stuffed + 1 + _TAIL


@njit(cache=True, error_model="numpy")
def _fd_bits(
    ident: np.int64, flag: np.int64, length: np.int64, data: NDArray[np.uint8], start: int, width: int
) -> tuple[np.int64, np.int64]:
    switch = np.int64(1 if flag & _BRS else 0)
    word, count = _arbitration(ident, (flag & _EXTENDED) != 0, np.int64(0))
    word = word << 3 | 4 | switch  # FDF recessive, res dominant, BRS
    count += 3
    state, stuffed = np.int64(0), np.int64(0)
    for shift in range(count - 2, -1, -1):
        bit = word >> shift & 1
        stuffed += np.int64(_STUFFED_BIT[state, bit])
        state = np.int64(_FOLLOW_BIT[state, bit])
    head = count + stuffed
    dlc = np.int64(_DLC_OF_LENGTH[min(length, np.int64(64))])
    payload = np.int64(_LENGTH_OF_DLC[dlc])
    word, stuffed = np.int64(16 if flag & _ESI else 0) | dlc, np.int64(0)
    for shift in range(4, -1, -1):
        bit = word >> shift & 1
        stuffed += np.int64(_STUFFED_BIT[state, bit])
        state = np.int64(_FOLLOW_BIT[state, bit])
    for column in range(payload):
        byte = data[start + column] if column < width else np.uint8(0)
        stuffed += np.int64(_STUFFED[state, byte])
        state = np.int64(_FOLLOW[state, byte])
    crc = 4 + 21 + 7 if payload > _LONG_FD else 4 + 17 + 6  # stuff count, CRC, their fixed stuff bits
    rest = 5 + 8 * payload + stuffed + crc + 1
    if switch:
        return head + _TAIL, rest
    return head + rest + _TAIL, np.int64(0)
