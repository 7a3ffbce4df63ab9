"""Pieces of the compiled scanners of logs in text.

A scanner takes only lines that it understands to the last letter. What no reader counts as a frame it passes over;
before any other line it stops with `ODD`, and who called decides on that line.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.canio.frames import FrameFlag

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Bytes = NDArray[np.uint8]
    Int64 = NDArray[np.int64]
    Words = NDArray[np.uint32]
    UInt64 = NDArray[np.uint64]
    Columns = tuple[Int64, Words, Bytes, Bytes, Bytes, Bytes]  # those of a FrameBlock, longer than the text has lines

# Why a scanner stopped: no text left, an odd line, a payload wider than the columns, a channel without a number.
DONE, ODD, WIDE, CHANNEL = range(4)
# Its state, which goes on from call to call: rows written, lines read, lines passed over.
ROWS, LINE, PASSED = range(3)

EXTENDED, REMOTE, ERROR, FD = map(int, (FrameFlag.EXTENDED, FrameFlag.REMOTE, FrameFlag.ERROR, FrameFlag.FD))
BITRATE_SWITCH, ERROR_STATE, SENT = map(int, (FrameFlag.BITRATE_SWITCH, FrameFlag.ERROR_STATE, FrameFlag.SENT))
_WHOLE_DIGITS, _FRACTION_DIGITS = 10, 9  # of seconds; nanoseconds in 64 bits hold no more

DIGIT = np.full(256, 99, np.uint8)  # of a hexadecimal digit
DIGIT[ord("0") : ord("9") + 1] = np.arange(10)
DIGIT[ord("A") : ord("F") + 1] = DIGIT[ord("a") : ord("f") + 1] = np.arange(10, 16)
_RETURN, _TAB, SPACE, DOT, _DELETE = 13, 9, 32, 46, 127

POWERS = 10 ** np.arange(10)
# Places in unsigned integers: numba need not ask at each one whether it counts from the end.
NOTHING, ONE, TWO, THREE, EIGHT, TEN, ELEVEN = (np.uint64(number) for number in (0, 1, 2, 3, 8, 10, 11))


STANDARD = 0x7FF  # the largest identifier of 11 bits
KEY = np.uint64(257)  # by which a name's key is multiplied at each letter


@njit(cache=True, error_model="numpy")
def key_of(name: Bytes) -> np.uint64:
    """Return the key of a channel's name; other names have other keys.

    That is certain for names of up to seven letters, and likely beyond them.
    """
    key = NOTHING
    for letter in name:
        key = key * KEY + np.uint64(letter)
    return key


@njit(cache=True, error_model="numpy")
def numbered(keys: UInt64, key: np.uint64, wanted: np.int64) -> np.int64:
    """Return the number of a channel with this key, -1 where it has none."""
    if wanted < len(keys) and keys[wanted] == key:
        return wanted
    for index in range(len(keys)):
        if keys[index] == key:
            return np.int64(index)
    return np.int64(-1)


@njit(cache=True, error_model="numpy")
def blank(byte: np.uint8) -> bool:
    """Return whether a byte is a space or a tab."""
    return bool(byte in (SPACE, _TAB))


@njit(cache=True, error_model="numpy")
def past_blanks(text: Bytes, at: np.int64, end: np.int64) -> np.int64:
    """Return where white space ends."""
    place, stop = np.uint64(at), np.uint64(end)
    while place < stop and blank(text[place]):
        place += np.uint64(1)
    return np.int64(place)


@njit(cache=True, error_model="numpy")
def past_token(text: Bytes, at: np.int64, end: np.int64) -> np.int64:
    """Return where a word ends."""
    place, stop = np.uint64(at), np.uint64(end)
    while place < stop and not blank(text[place]):
        place += np.uint64(1)
    return np.int64(place)


@njit(cache=True, error_model="numpy")
def trimmed(text: Bytes, at: np.int64, end: np.int64) -> np.int64:
    """Return where a line ends without the white space at its end."""
    while end > at and (blank(text[end - 1]) or text[end - 1] == _RETURN):
        end -= 1
    return end


@njit(cache=True, error_model="numpy")
def is_plain(text: Bytes, at: np.int64, end: np.int64) -> bool:
    """Return whether a line holds printable letters, spaces and tabs alone."""
    for index in range(at, end):
        byte = text[index]
        if byte >= _DELETE or (byte < SPACE and byte != _TAB and (byte != _RETURN or index + 1 != end)):
            return False
    return True


@njit(cache=True, error_model="numpy")
def number(text: Bytes, at: np.int64, end: np.int64, base: np.int64, most: np.int64) -> tuple[np.int64, np.int64]:
    """Return the number of at most so many digits that starts here and where it ends.

    The number is -1 where there is none.
    """
    value, place, stop = np.int64(0), np.uint64(at), np.uint64(end)
    while place < stop and DIGIT[text[place]] < base:
        value = value * base + DIGIT[text[place]]
        place += np.uint64(1)
    first, at = at, np.int64(place)
    if at == first or at - first > most:
        return np.int64(-1), at
    return value, at


@njit(cache=True, error_model="numpy")
def seconds(text: Bytes, at: np.int64, end: np.int64) -> tuple[np.int64, np.int64, bool]:
    """Return seconds with a point in ns, where they end, and whether there are any.

    The result is -1 ns where there are too many digits.
    """
    whole, point = number(text, at, end, np.int64(10), np.int64(_WHOLE_DIGITS))
    if point == at or point >= end or text[point] != DOT:
        return np.int64(-1), at, False
    value, stop = np.int64(0), point + 1
    while stop < end and DIGIT[text[stop]] < 10:
        value = value * 10 + DIGIT[text[stop]]
        stop += 1
    digits = stop - point - 1
    if digits == 0:
        return np.int64(-1), at, False
    if whole < 0 or whole > 9_000_000_000 or digits > _FRACTION_DIGITS:
        return np.int64(-1), stop, True
    for _ in range(_FRACTION_DIGITS - digits):
        value *= 10
    return whole * 1_000_000_000 + value, stop, True


@njit(cache=True, error_model="numpy")
def starts_with(text: Bytes, at: np.int64, end: np.int64, word: Bytes) -> bool:
    """Return whether a word of small letters starts here, in letters of any case."""
    if end - at < len(word):
        return False
    for index in range(len(word)):  # noqa: SIM110 (numba compiles no generators)
        if text[at + index] | 0x20 != word[index]:
            return False
    return True


@njit(cache=True, error_model="numpy")
def put(
    columns: Columns,
    row: np.int64,
    stamp: np.int64,
    ident: np.int64,
    flag: np.int64,
    length: np.int64,
    channel: np.int64,
) -> None:
    """Write a frame without data."""
    columns[4][row] = 0
    put_rest(columns, row, stamp, ident, flag, length, channel)


@njit(cache=True, error_model="numpy")
def put_rest(
    columns: Columns,
    row: np.int64,
    stamp: np.int64,
    ident: np.int64,
    flag: np.int64,
    length: np.int64,
    channel: np.int64,
) -> None:
    """Write all of a frame but its data."""
    columns[0][row], columns[1][row], columns[2][row] = stamp, ident, flag
    columns[3][row], columns[5][row] = length, channel
