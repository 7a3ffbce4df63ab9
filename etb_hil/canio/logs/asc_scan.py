"""Compiled scanner of Vector's ASC logs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.canio.frames import FD_LENGTHS
from etb_hil.canio.logs.text_scan import (
    BITRATE_SWITCH,
    CHANNEL,
    DIGIT,
    DONE,
    DOT,
    ELEVEN,
    ERROR,
    ERROR_STATE,
    EXTENDED,
    FD,
    LINE,
    NOTHING,
    ODD,
    ONE,
    PASSED,
    POWERS,
    REMOTE,
    ROWS,
    SENT,
    SPACE,
    STANDARD,
    TEN,
    THREE,
    TWO,
    WIDE,
    blank,
    is_plain,
    number,
    numbered,
    past_blanks,
    past_token,
    put,
    put_rest,
    seconds,
    starts_with,
    trimmed,
)

if TYPE_CHECKING:
    from etb_hil.canio.logs.text_scan import Bytes, Columns, Int64, UInt64

_LENGTHS = np.array(FD_LENGTHS, np.int64)
_MAX_IDENT = 0x1FFFFFFF
_MAX_CHANNEL = 256  # as the file counts them
_IS_WORD = np.array([chr(code).isalnum() or code == ord("_") for code in range(128)] + [False] * 128)
_ERRORFRAME = np.frombuffer(b"errorframe", np.uint8)
_R, _T, _D, _EXTENDED_MARK = 82, 84, 100, 120  # R T d x
_CANFD, _BASE = np.frombuffer(b"canfd", np.uint8), np.frombuffer(b"base", np.uint8)


@njit(cache=True, error_model="numpy")
def scan_asc(
    text: Bytes,
    newlines: Int64,
    plain: bool,
    base: int,
    keys: UInt64,
    columns: Columns,
    passed: Int64,
    state: Int64,
) -> int:
    """Read the events of an ASC log from line `state[LINE]` on; numbers are of `base`.

    `newlines` says where each line ends, `plain` whether all are known to be plain text. `keys` (256): what the
    channels with a number are known by, at their numbers; 0 where there is none. Lines without a frame are entered in
    `passed`, `state[PASSED]` of them.
    """
    stamps, idents, flags, lengths, data, channels = columns
    row, line, reason = state[ROWS], state[LINE], DONE
    at = newlines[line - 1] + 1 if line else np.int64(0)
    while line < len(newlines):
        stop = newlines[line]
        if plain and base == 16:
            # The usual line, `seconds channel ident Rx d length payload`, in scalars alone: a helper that takes arrays
            # costs more than all of it. Its end stops every loop, and unsigned places need no check of their sign.
            place = np.uint64(at)
            while text[place] == SPACE:
                place += ONE
            begin, whole = place, np.int64(0)
            while DIGIT[text[place]] < 10:
                whole = whole * 10 + DIGIT[text[place]]
                place += ONE
            point, fraction = place, np.int64(0)
            if text[place] == DOT:
                place += ONE
            while DIGIT[text[place]] < 10:
                fraction = fraction * 10 + DIGIT[text[place]]
                place += ONE
            is_usual = NOTHING < point - begin < TEN and ONE < place - point < ELEVEN and text[place] == SPACE
            digits = place - point - ONE
            while text[place] == SPACE:
                place += ONE
            begin, channel = place, np.int64(0)
            while DIGIT[text[place]] < 10:
                channel = channel * 10 + DIGIT[text[place]]
                place += ONE
            is_usual &= NOTHING < place - begin < TEN and text[place] == SPACE and channel <= _MAX_CHANNEL
            counted = max(int(channel) - 1, 0)
            is_usual = is_usual and keys[counted] == key_of_number(channel)
            while text[place] == SPACE:
                place += ONE
            begin, ident, extended = place, np.int64(0), np.int64(0)
            while DIGIT[text[place]] < 16:
                ident = ident << 4 | DIGIT[text[place]]
                place += ONE
            is_usual &= NOTHING < place - begin < TEN and ident <= _MAX_IDENT
            if text[place] == _EXTENDED_MARK:
                extended = np.int64(EXTENDED)
                place += ONE
            is_usual &= text[place] == SPACE and (extended != 0 or ident <= STANDARD)
            while text[place] == SPACE:
                place += ONE
            sent = text[place] == _T
            if is_usual and (sent or text[place] == _R) and text[place + ONE] == _EXTENDED_MARK:
                place += TWO
                is_usual = text[place] == SPACE
                while text[place] == SPACE:
                    place += ONE
                is_usual &= text[place] == _D and text[place + ONE] == SPACE
                length = DIGIT[text[place + TWO]] if is_usual else np.uint8(99)
                if length <= 8:
                    place += THREE
                    wrong, out = np.uint8(0), np.uint64(row)
                    for index in range(np.uint64(length)):
                        high, low = DIGIT[text[place + ONE]], DIGIT[text[place + TWO]]
                        wrong |= (high | low) & 0xF0 | (text[place] ^ SPACE)
                        data[out, index] = high << 4 | low & 15
                        place += THREE
                    if wrong == 0 and text[place] <= SPACE:
                        for index in range(np.uint64(length), np.uint64(data.shape[1])):
                            data[out, index] = 0
                        stamps[out] = whole * 1_000_000_000 + fraction * POWERS[np.uint64(9) - digits]
                        idents[out], lengths[out] = ident, length
                        flags[out] = extended | (SENT if sent else 0)
                        channels[out] = counted
                        row, at, line = row + 1, stop + 1, line + 1
                        continue
        elif not (plain or is_plain(text, at, stop)):
            reason = ODD
            break
        end = trimmed(text, at, stop)
        at = past_blanks(text, at, end)
        found = _asc_event(text, at, end, np.int64(base), keys, columns, row)
        if found < 0:
            reason = int(-found)
            break
        if found == 0:
            passed[state[PASSED]] = line
            state[PASSED] += 1
        row += found
        at, line = stop + 1, line + 1
    state[ROWS], state[LINE] = row, line
    return reason


@njit(cache=True, error_model="numpy")
def _asc_event(
    text: Bytes, at: np.int64, end: np.int64, base: np.int64, keys: UInt64, columns: Columns, row: np.int64
) -> np.int64:
    """Return 1 for a frame, written into its row, 0 for another event.

    A negative number says why it was not read.
    """
    nothing, odd = np.int64(0), np.int64(-ODD)
    if starts_with(text, at, end, _BASE):  # numbers may be written in another way from here on
        return odd
    stamp, at, there = seconds(text, at, end)
    if not there or at >= end or not blank(text[at]):
        return nothing
    at = past_blanks(text, at, end)
    if starts_with(text, at, end, _CANFD):
        return odd if stamp < 0 else _asc_fd(text, at, end, base, stamp, keys, columns, row)
    first = at
    channel, at = number(text, at, end, np.int64(10), np.int64(9))
    if at == first or at >= end or not blank(text[at]):
        return nothing
    at = past_blanks(text, at, end)
    channel = _index(channel, keys)
    if starts_with(text, at, end, _ERRORFRAME):
        if stamp < 0 or channel < 0:
            return odd if stamp < 0 else channel
        put(columns, row, stamp, np.int64(0), np.int64(ERROR | EXTENDED), np.int64(0), channel)
        return np.int64(1)
    return _asc_classic(text, at, end, base, stamp, channel, columns, row)


@njit(cache=True, error_model="numpy")
def _asc_classic(
    text: Bytes,
    at: np.int64,
    end: np.int64,
    base: np.int64,
    stamp: np.int64,
    channel: np.int64,
    columns: Columns,
    row: np.int64,
) -> np.int64:
    """Read `ident direction d|r length payload`; the result is that of `_asc_event`."""
    nothing, odd, width = np.int64(0), np.int64(-ODD), columns[4].shape[1]
    first = at
    while at < end and _IS_WORD[text[at]]:
        at += 1
    if at == first or at >= end or not blank(text[at]):
        return nothing
    flag, at_ident = _direction(text, past_blanks(text, at, end), end), first
    if flag == -2:
        return nothing
    ident, extended = _identifier(text, at_ident, at, base)
    if flag < 0 or ident < 0 or stamp < 0 or (not extended and ident > STANDARD):
        return odd
    if channel < 0:
        return channel
    flag |= extended
    at = past_blanks(text, past_blanks(text, at, end) + 2, end)
    if at >= end or (at + 1 < end and not blank(text[at + 1])):
        return odd
    kind, at = text[at] | 0x20, past_blanks(text, at + 1, end)
    if kind == 114:  # r
        length = np.int64(0)
        if at < end and DIGIT[text[at]] < 10:
            length, at = number(text, at, end, base, np.int64(1))
            if length < 0 or length > 8 or (at < end and not blank(text[at])):
                return odd
        put(columns, row, stamp, ident, flag | REMOTE, length, channel)
        return np.int64(1)
    length, at = number(text, at, end, base, np.int64(2))
    if kind != 100 or length < 0 or length > 15:  # d
        return odd
    length = min(length, np.int64(8))
    if not _payload(text, at, end, base, length, columns[4], row, width):
        return odd
    put_rest(columns, row, stamp, ident, flag, length, channel)
    return np.int64(1)


@njit(cache=True, error_model="numpy")
def _asc_fd(
    text: Bytes,
    at: np.int64,
    end: np.int64,
    base: np.int64,
    stamp: np.int64,
    keys: UInt64,
    columns: Columns,
    row: np.int64,
) -> np.int64:
    """Read `CANFD channel direction ident [name] brs esi code length payload`.

    The result is that of `_asc_event`.
    """
    odd = np.int64(-ODD)
    start = at
    at += 5
    for index in range(start, at):
        if text[index] & 0x20:  # small letters: no frame, as its reader says
            return np.int64(0)
    if at >= end or not blank(text[at]):
        return np.int64(0)
    channel, at = number(text, past_blanks(text, at, end), end, np.int64(10), np.int64(9))
    if channel < 0 or at >= end or not blank(text[at]):
        return odd
    channel = _index(channel, keys)
    if channel < 0:
        return channel
    at = past_blanks(text, at, end)
    flag = _direction(text, at, end)
    if flag < 0:
        return odd
    at = past_blanks(text, at + 2, end)
    if starts_with(text, at, end, _ERRORFRAME):
        put(columns, row, stamp, np.int64(0), flag | ERROR | FD | EXTENDED, np.int64(0), channel)
        return np.int64(1)
    stop = past_token(text, at, end)
    ident, extended = _identifier(text, at, stop, base)
    if ident < 0 or (not extended and ident > STANDARD):
        return odd
    flag |= extended | FD
    at = past_blanks(text, stop, end)
    named = False
    stop = past_token(text, at, end)
    for index in range(at, stop):
        named |= DIGIT[text[index]] > 9
    if named:
        at = past_blanks(text, stop, end)
    for bit in (BITRATE_SWITCH, ERROR_STATE):
        value, at = number(text, at, end, np.int64(10), np.int64(9))
        if value < 0 or at >= end or not blank(text[at]):
            return odd
        flag |= bit if value == 1 else 0
        at = past_blanks(text, at, end)
    code, at = number(text, at, end, base, np.int64(2))
    if code < 0 or code > 15 or at >= end or not blank(text[at]):
        return odd
    length, at = number(text, past_blanks(text, at, end), end, np.int64(10), np.int64(2))
    if length < 0 or at >= end:
        return odd
    if length == 0:  # a remote frame, as its reader says
        put(columns, row, stamp, ident, flag | REMOTE, code, channel)
        return np.int64(1)
    if length != _LENGTHS[code]:
        return odd
    if length > columns[4].shape[1]:
        return np.int64(-WIDE)
    if not _payload(text, at, end, base, length, columns[4], row, columns[4].shape[1]):
        return odd
    put_rest(columns, row, stamp, ident, flag, length, channel)
    return np.int64(1)


@njit(cache=True, error_model="numpy")
def _direction(text: Bytes, at: np.int64, end: np.int64) -> np.int64:
    """Return the flag of `Rx` or `Tx`.

    The result is -1 where it is written in another way, -2 where there is no direction.
    """
    if end - at < 2 or text[at + 1] | 0x20 != 120 or (text[at] | 0x20 != 114 and text[at] | 0x20 != 116):
        return np.int64(-2)
    if text[at + 1] != 120 or text[at] & 0x20 or (end - at > 2 and not blank(text[at + 2])):
        return np.int64(-1)
    return np.int64(SENT if text[at] == 84 else 0)


@njit(cache=True, error_model="numpy")
def _identifier(text: Bytes, at: np.int64, end: np.int64, base: np.int64) -> tuple[np.int64, np.int64]:
    """Return the identifier in a token and its flag for 29 bits; -1 where it is none."""
    extended = np.int64(0)
    if end > at and text[end - 1] | 0x20 == 120:
        extended, end = np.int64(EXTENDED), end - 1
    value, stop = number(text, at, end, base, np.int64(10))
    if stop != end or value > _MAX_IDENT:
        return np.int64(-1), extended
    return value, extended


@njit(cache=True, error_model="numpy")
def _payload(
    text: Bytes, at: np.int64, end: np.int64, base: np.int64, length: np.int64, data: Bytes, row: np.int64, width: int
) -> bool:
    """Write the bytes that follow, each behind white space.

    False where one is missing or none.
    """
    if base == 16 and at + 3 * length <= end and (at + 3 * length == end or blank(text[at + 3 * length])):
        # Unsigned places: numba need not ask at each one whether it counts from the end.
        wrong, place, out, one, three = np.uint8(0), np.uint64(at), np.uint64(row), np.uint64(1), np.uint64(3)
        for index in range(np.uint64(length)):
            high, low = DIGIT[text[place + one]], DIGIT[text[place + one + one]]
            wrong |= (high | low) & 0xF0 | (text[place] ^ SPACE)
            data[out, index] = high << 4 | low & 15
            place += three
        if wrong == 0:
            for index in range(np.uint64(length), np.uint64(width)):
                data[out, index] = 0
            return True
    for index in range(length):
        if at >= end or not blank(text[at]):
            return False
        value, at = number(text, past_blanks(text, at, end), end, base, np.int64(3))
        if value < 0 or value > 255:
            return False
        data[row, index] = value
    for index in range(length, width):
        data[row, index] = 0
    return at == end or blank(text[at])


@njit(cache=True, error_model="numpy")
def key_of_number(channel: np.int64) -> np.uint64:
    """Return what a channel of the file is known by."""
    return np.uint64(channel + 1)


@njit(cache=True, error_model="numpy")
def _index(channel: np.int64, keys: UInt64) -> np.int64:
    """Return the number of a channel of the file, negative: why there is none."""
    if channel < 0:
        return np.int64(-ODD)
    index = numbered(keys, key_of_number(channel), np.int64(max(int(channel) - 1, 0)))
    return index if index >= 0 else np.int64(-CHANNEL)
