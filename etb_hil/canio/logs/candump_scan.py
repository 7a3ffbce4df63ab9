"""Compiled scanner of the logs that `candump -L` writes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.canio.logs.text_scan import (
    BITRATE_SWITCH,
    CHANNEL,
    DIGIT,
    DONE,
    DOT,
    EIGHT,
    ELEVEN,
    ERROR,
    ERROR_STATE,
    EXTENDED,
    FD,
    KEY,
    LINE,
    NOTHING,
    ODD,
    ONE,
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
    key_of,
    number,
    numbered,
    past_blanks,
    past_token,
    put,
    put_rest,
    seconds,
    trimmed,
)

if TYPE_CHECKING:
    from etb_hil.canio.logs.text_scan import Bytes, Columns, Int64, UInt64

_MAX_IDENT = 0x1FFFFFFF
_FAR = 256  # a channel that no column holds
_ERROR_IDENT = 0x20000000  # SocketCAN's bit for error frames
_LATEST_S = 9_000_000_000  # what 64 bits hold in nanoseconds
_OPEN, _CLOSE, _HASH, _R, _T = 40, 41, 35, 114, 116  # ( ) # r t
_RECEIVED, _SENT = 82, 84  # R T
_SMALL = 0x20  # makes a letter a small one


@njit(cache=True, error_model="numpy")
def scan_candump(text: Bytes, newlines: Int64, plain: bool, keys: UInt64, columns: Columns, state: Int64) -> int:
    """Read lines as `candump -L` writes them from line `state[LINE]` on.

    `newlines` says where each line ends, `plain` whether all are known to be plain text. `keys` (256): what
    the channels with a number are known by, at their numbers; 0 where there is none.
    """
    stamps, idents, flags, lengths, data, channels = columns
    row, line, reason = state[ROWS], state[LINE], DONE
    at = newlines[line - 1] + 1 if line else np.int64(0)
    while line < len(newlines):
        stop = newlines[line]
        if plain:
            # The usual line, `(seconds) channel ident#payload [R|T]`, in scalars alone: a helper that takes arrays
            # costs more than all of it. Its end stops every loop, and unsigned places need no check of their sign.
            place = np.uint64(at) + ONE
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
            is_usual = NOTHING < point - begin < ELEVEN and ONE < place - point < ELEVEN and text[at] == _OPEN
            is_usual &= whole < _LATEST_S and text[place] == _CLOSE and text[place + ONE] == SPACE
            digits = place - point - ONE
            if is_usual:
                place += TWO
                channel, key = 0, NOTHING
                while text[place] > SPACE:
                    digit = DIGIT[text[place]]
                    channel = min(channel * 10 + int(digit), _FAR) if digit < 10 else 0
                    key = key * KEY + np.uint64(text[place])
                    place += ONE
                is_usual = text[place] == SPACE and channel < _FAR and keys[channel] == key
                place += ONE if is_usual else NOTHING
                begin, ident = place, np.int64(0)
                while DIGIT[text[place]] < 16:
                    ident = ident << 4 | DIGIT[text[place]]
                    place += ONE
                letters = place - begin
                is_usual &= NOTHING < letters < TEN and ident <= _MAX_IDENT and text[place] == _HASH
                is_usual &= letters > THREE or ident <= STANDARD
                last, sent = np.uint64(stop), text[stop - 1] == _SENT
                if text[stop - 2] == SPACE and (sent or text[stop - 1] == _RECEIVED):  # a direction
                    last -= TWO
                length = (last - place) // TWO
                if is_usual and length <= EIGHT and last - place == ONE + TWO * length:
                    wrong, out = np.uint8(0), np.uint64(row)
                    for index in range(length):
                        high, low = DIGIT[text[place + ONE]], DIGIT[text[place + TWO]]
                        wrong |= high | low
                        data[out, index] = high << 4 | low & 15
                        place += TWO
                    if wrong < 16:
                        for index in range(length, np.uint64(data.shape[1])):
                            data[out, index] = 0
                        stamps[out] = whole * 1_000_000_000 + fraction * POWERS[np.uint64(9) - digits]
                        idents[out], lengths[out], channels[out] = ident, length, channel
                        flags[out] = (EXTENDED if letters > THREE else 0) | (SENT if sent else 0)
                        row, at, line = row + 1, stop + 1, line + 1
                        continue
        elif not is_plain(text, at, stop):
            reason = ODD
            break
        end = trimmed(text, at, stop)
        at = past_blanks(text, at, end)
        found = _frame(text, at, end, keys, columns, row) if at < end else np.int64(0)
        if found < 0:
            reason = int(-found)
            break
        row += found
        at, line = stop + 1, line + 1
    state[ROWS], state[LINE] = row, line
    return reason


@njit(cache=True, error_model="numpy")
def _frame(text: Bytes, at: np.int64, end: np.int64, keys: UInt64, columns: Columns, row: np.int64) -> np.int64:
    """Read `(seconds) channel ident#payload [direction]`.

    Return 1, or why it was not read, negative.
    """
    odd = np.int64(-ODD)
    if text[at] != _OPEN:
        return odd
    stamp, at, _ = seconds(text, at + 1, end)
    if stamp < 0 or at + 1 >= end or text[at] != _CLOSE or not blank(text[at + 1]):
        return odd
    first = past_blanks(text, at + 1, end)
    at = past_token(text, first, end)
    channel = numbered(keys, key_of(text[first:at]), _channel(text, first, at))
    first = past_blanks(text, at, end)
    ident, at = number(text, first, end, np.int64(16), np.int64(8))
    flag, most = np.int64(EXTENDED if at - first > 3 else 0), np.int64(8)
    if ident < 0 or at >= end or text[at] != _HASH or (not flag and ident > STANDARD):
        return odd
    at += 1
    if at < end and text[at] == _HASH:
        if at + 1 >= end or DIGIT[text[at + 1]] > 15:
            return odd
        bits = DIGIT[text[at + 1]]
        flag |= FD | (BITRATE_SWITCH if bits & 1 else 0) | (ERROR_STATE if bits & 2 else 0)
        at, most = at + 2, np.int64(64)
    stop = past_token(text, at, end)
    length = np.int64((stop - at) // 2)
    remote = at < end and text[at] | _SMALL == _R
    if remote:
        if flag & FD or stop - at > 2 or (stop - at == 2 and DIGIT[text[at + 1]] > 8):
            return odd
        length = np.int64(DIGIT[text[at + 1]] if stop - at == 2 else 0)
        flag |= REMOTE
    elif length > most or (stop - at) % 2:
        return odd
    elif length > columns[4].shape[1]:
        return np.int64(-WIDE)
    elif not _payload(text, at, length, columns[4], row):
        return odd
    at = past_blanks(text, stop, end)
    if at < end:
        direction = text[at] | _SMALL
        if at + 1 != end or (direction not in (_R, _T)):
            return odd
        flag |= SENT if direction == _T else 0
    if channel < 0:  # last: a damaged line names no channel
        return np.int64(-CHANNEL)
    if ident & _ERROR_IDENT:
        put(columns, row, stamp, np.int64(0), np.int64(ERROR | EXTENDED), np.int64(0), channel)
    elif remote:
        put(columns, row, stamp, ident & _MAX_IDENT, flag, length, channel)
    else:
        put_rest(columns, row, stamp, ident & _MAX_IDENT, flag, length, channel)
    return np.int64(1)


@njit(cache=True, error_model="numpy")
def _channel(text: Bytes, first: np.int64, end: np.int64) -> np.int64:
    """Return the number at the end of a channel's name.

    `_FAR` where 8 bits do not hold it.
    """
    digits = end
    while digits > first and DIGIT[text[digits - 1]] < 10:
        digits -= 1
    channel = 0
    for index in range(digits, end):
        channel = min(channel * 10 + int(DIGIT[text[index]]), _FAR)
    return np.int64(channel)


@njit(cache=True, error_model="numpy")
def _payload(text: Bytes, at: np.int64, length: np.int64, data: Bytes, row: np.int64) -> bool:
    """Write the bytes that start here into a row; False where a letter is no digit."""
    # Unsigned places: numba need not ask at each one whether it counts from the end.
    wrong, place, out, two = np.uint8(0), np.uint64(at), np.uint64(row), np.uint64(2)
    for index in range(np.uint64(length)):
        high, low = DIGIT[text[place]], DIGIT[text[place + np.uint64(1)]]
        wrong |= high | low
        data[out, index] = high << 4 | low & 15
        place += two
    for index in range(np.uint64(length), np.uint64(data.shape[1])):
        data[out, index] = 0
    return bool(wrong < 16)
