"""All signals of a DBC file as columns, in numpy alone.

This is for exports and for a look into a log, without compiling.

The values are cantools', bit for bit. What judges a unit goes through `decoder.py`, which checks and clocks frames too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from etb_hil.canio.dbc.dbc_file import require_distinct
from etb_hil.canio.frames import FrameFlag

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from cantools.database.can import Message, Signal
    from numpy.typing import NDArray

    from etb_hil.canio.frames import FrameBlock

    Float64 = NDArray[np.float64]
    Bytes = NDArray[np.uint8]

_WORD = 8
_LAST = 56  # byte at which the last word of a payload starts
_FLOAT_BITS = 53
_EXACT_IN_FLOAT = 1 << _FLOAT_BITS
_FEW = 64  # messages up to which a comparison each is cheaper than sorting all frames
_EXTENDED = 0x80000000
_NO_DATA = FrameFlag.REMOTE | FrameFlag.ERROR
_FLOATS = {16: np.uint16, 32: np.uint32, 64: np.uint64}
_FLOAT_OF = {16: np.float16, 32: np.float32, 64: np.float64}


@dataclass(slots=True)
class Rounded:
    """The values of a signal that float64 does not hold to the last bit.

    `first_ns` is the stamp of the first.
    """

    values: int = 0
    first_ns: int = 0

    def note(self, lost: NDArray[np.bool_], stamp_ns: NDArray[np.int64]) -> None:
        """Count values (n) that were rounded."""
        if lost.any():
            self.first_ns = self.first_ns if self.values else int(stamp_ns[np.argmax(lost)])
            self.values += int(np.count_nonzero(lost))


@dataclass(frozen=True, slots=True)
class MessageColumns:
    """The frames of one message: `stamp_ns` (n), and signals' values (n).

    Values are physical, and NaN where multiplexed out.
    """

    message: str
    stamp_ns: NDArray[np.int64]
    columns: Mapping[str, Float64]


class ColumnDecoder:
    """Decodes the frames of some messages of a DBC file, whole blocks at a time.

    Frames that are too short for their message are left out and counted in `too_short`. Integers beyond 2^53 that
    float64 does not hold are `rounded`. Raises InputError where two messages, or two signals of one, cannot be
    distinguished.
    """

    def __init__(self, messages: Iterable[Message], id_offset: int = 0) -> None:
        messages = [message for message in messages if not message.is_container]
        require_distinct(messages)
        self._readers = {
            (m.frame_id + id_offset) | (_EXTENDED if m.is_extended_frame else 0): _MessageReader(m) for m in messages
        }
        self.too_short = 0

    @property
    def rounded(self) -> dict[str, Rounded]:
        """The signals of which values were rounded, by `Message.Signal`."""
        each = (one for reader in self._readers.values() for one in reader.rounded.items())
        return {name: one for name, one in each if one.values}

    def push(self, frames: FrameBlock) -> list[MessageColumns]:
        """Return the columns of each message that has frames in the block."""
        keys = frames.ident
        if frames.flags.any():
            keys = keys | np.where(frames.flags & FrameFlag.EXTENDED, np.uint32(_EXTENDED), np.uint32(0))
            keys[(frames.flags & _NO_DATA) != 0] = 0xFFFFFFFF  # no identifier
        found = []
        for key, rows in self._rows(keys):
            reader = self._readers[key]
            whole = frames.length[rows] >= reader.length
            if not whole.all():
                self.too_short += int(np.count_nonzero(~whole))
                rows = rows[whole]  # noqa: PLW2901 (the whole ones)
            if len(rows):
                found.append(reader.read(frames.data.take(rows, axis=0), frames.stamp_ns[rows]))
        return found

    def _rows(self, keys: NDArray[np.uint32]) -> Iterable[tuple[int, NDArray[np.intp]]]:
        if len(self._readers) <= _FEW:
            pairs = ((key, np.flatnonzero(keys == key)) for key in self._readers)
            return ((key, rows) for key, rows in pairs if len(rows))
        order = np.argsort(keys, kind="stable")
        there, first = np.unique(keys[order], return_index=True)
        groups = zip(there.tolist(), np.split(order, first[1:]), strict=True)
        return ((key, rows) for key, rows in groups if key in self._readers)


class _MessageReader:
    """Read one message: its payloads as a few words of 64 bits.

    Each word serves all signals that lie in it.
    """

    def __init__(self, message: Message) -> None:
        self.length = message.length
        self._name = message.name
        self._by_name = {signal.name: signal for signal in message.signals}
        self._switches = {signal.multiplexer_signal for signal in message.signals}
        self._signals: list[_SignalReader] = []
        self._words: list[tuple[int, str]] = []  # first byte and order of each
        for order, there in (("<u8", "little_endian"), (">u8", "big_endian")):
            covered = 0  # bits
            for signal in sorted((s for s in message.signals if s.byte_order == there), key=_first_bit):
                end = _first_bit(signal) + signal.length
                if end > covered and _plain_type(signal) is None:
                    first = 0 if message.length <= _WORD else min(_first_bit(signal) // 8, _LAST)
                    self._words.append((first, order))
                    covered = 8 * (first + _WORD)
                first = self._words[-1][0] if self._words else 0
                self._signals.append(_SignalReader(signal, len(self._words) - 1, first))
        self._reach = max((reader.reach for reader in self._signals), default=0)
        place = {reader.name: row for row, reader in enumerate(self._signals)}
        self._rows = {name: place[name] for name in self._by_name}
        self.rounded = {f"{message.name}.{one.name}": Rounded() for one in self._signals if one.may_round}

    def read(self, data: Bytes, stamp_ns: NDArray[np.int64]) -> MessageColumns:
        if self._reach > data.shape[1]:  # a signal that does not lie inside its message
            padded = np.zeros((len(data), self._reach), np.uint8)
            padded[:, : data.shape[1]] = data
            data = padded
        count, width = data.shape
        # Eight bytes at any place in a row, without copying them as bytes first.
        words = [np.ndarray((count,), order, data, at, (width,)).astype(np.uint64) for at, order in self._words]
        out, scratch = np.empty((len(self._signals), count)), np.empty(count, np.uint64)
        signed = scratch.view(np.int64)
        raw: dict[str, NDArray[np.generic]] = {}
        lost: dict[str, NDArray[np.bool_]] = {}
        with np.errstate(invalid="ignore"):  # a payload may spell a NaN that signals
            for reader, column in zip(self._signals, out, strict=True):
                bits = reader.plain(data) if reader.is_plain else reader.bits(data, words[reader.word], scratch, signed)
                reader.scale(bits, column)
                if reader.may_round:
                    lost[reader.name] = reader.rounds(bits, column)
                if reader.name in self._switches:
                    raw[reader.name] = bits.copy()
        for reader, column in zip(self._signals, out, strict=True):
            active = self._active(reader.name, raw) if reader.is_multiplexed else None
            if active is not None:
                column[~active] = np.nan
            if reader.may_round:
                rounded = lost[reader.name] if active is None else lost[reader.name] & active
                self.rounded[f"{self._name}.{reader.name}"].note(rounded, stamp_ns)
        return MessageColumns(self._name, stamp_ns, {name: out[row] for name, row in self._rows.items()})

    def _active(self, name: str, raw: Mapping[str, NDArray[np.generic]]) -> NDArray[np.bool_] | None:
        """Return in which frames a signal's multiplexers choose it.

        None where it has none.
        """
        active, signal = None, self._by_name[name]
        while signal.multiplexer_signal:
            chosen = np.isin(raw[signal.multiplexer_signal], np.array(signal.multiplexer_ids or [], np.int64))
            active = chosen if active is None else active & chosen
            signal = self._by_name[signal.multiplexer_signal]
        return active


def _first_bit(signal: Signal) -> int:
    """Return how many bits of the payload stand before a signal, in its own order."""
    start: int = signal.start
    return start if signal.byte_order == "little_endian" else start // 8 * 8 + 7 - start % 8


def _plain_type(signal: Signal) -> np.dtype[Any] | None:
    """Return the numpy type of a signal of whole bytes, None of any other."""
    if _first_bit(signal) % 8 or signal.length not in {8, 16, 32, 64} or (signal.is_float and signal.length == 8):
        return None
    order = ">" if signal.byte_order == "big_endian" else "<"
    return np.dtype(f"{order}{'f' if signal.is_float else 'i' if signal.is_signed else 'u'}{signal.length // 8}")


class _SignalReader:
    """Read one signal.

    A number of whole bytes is read as it stands, any other out of a word of eight bytes.

    The word starts at a byte of the payload; the few bits of a ninth byte are added. It is moved left, then right: its
    sign comes along, and what belongs to others goes.
    """

    def __init__(self, signal: Signal, word: int, first: int) -> None:
        self.name, self.word = signal.name, word
        self.is_multiplexed = bool(signal.multiplexer_signal)
        self._length, self._is_signed, self._is_float = signal.length, signal.is_signed, signal.is_float
        self._motorola = signal.byte_order == "big_endian"
        self._type, self._byte = _plain_type(signal), _first_bit(signal) // 8
        self.is_plain = self._type is not None
        skip = 0 if self.is_plain else _first_bit(signal) - 8 * first
        self._skip = np.uint64(skip)
        self._left = np.uint64(skip if self._motorola else max(0, 64 - skip - signal.length))
        self._room = 64 - signal.length
        self._right = np.int64(self._room) if signal.is_signed else np.uint64(self._room)
        self._ninth, self._ninth_at = max(0, skip + signal.length - 64), first + _WORD
        self.reach = first + _WORD + (1 if self._ninth else 0)
        if self.is_plain:
            self.reach = self._byte + signal.length // 8
        self._scale, self._offset = np.float64(signal.scale), float(signal.offset)
        self._exact = _exact_factors(signal)
        self.may_round = not signal.is_float and (self._exact is not None or signal.length > _FLOAT_BITS)

    def plain(self, data: Bytes) -> NDArray[np.generic]:
        """Return a number of whole bytes, as a view."""
        return np.ndarray((len(data),), self._type, data, self._byte, (data.shape[1],))

    def bits(
        self, data: Bytes, word: NDArray[np.uint64], scratch: NDArray[np.uint64], signed: NDArray[np.int64]
    ) -> NDArray[np.generic]:
        """Return the bits as an integer with its sign, or as a float.

        `signed` is `scratch` with a sign.

        What is returned lies in them and is good until the next call.
        """
        if self._ninth:
            word = self._word_of_nine(data, word)
        elif self._left:
            word = np.left_shift(word, self._left, out=scratch)
        if self._is_signed:
            np.right_shift(word.view(np.int64), self._right, out=signed)
        else:
            np.right_shift(word, self._right, out=scratch)
        if self._is_float:
            return scratch.astype(_FLOATS[self._length]).view(_FLOAT_OF[self._length])
        return signed if self._is_signed or self._room else scratch

    def _word_of_nine(self, data: Bytes, word: NDArray[np.uint64]) -> NDArray[np.uint64]:
        """Return the signal, which lies in nine bytes, at the upper end of a word."""
        ninth = data[:, self._ninth_at].astype(np.uint64)
        if self._motorola:
            return word << self._skip | ninth << self._skip >> np.uint64(8)
        bits = word >> self._skip | ninth << np.uint64(64 - int(self._skip))
        return bits << np.uint64(self._room)

    def rounds(self, raw: NDArray[np.generic], physical: Float64) -> NDArray[np.bool_]:
        """Return which integers (n) have more significant bits than float64 holds.

        Of those that a scale takes beyond 64 bits, all physical values beyond 2^53 count.
        """
        if self._exact is not None:
            raw = raw.astype(np.int64) * np.int64(self._exact[0]) + np.int64(self._exact[1])
        elif self._offset or abs(math.frexp(self._scale)[0]) != 0.5:
            return np.asarray(np.abs(physical) >= _EXACT_IN_FLOAT)
        is_signed = raw.dtype.kind == "i"
        size = np.abs(raw.astype(np.int64)).astype(np.uint64) if is_signed else raw.astype(np.uint64)
        lowest = np.maximum(size & (~size + np.uint64(1)), np.uint64(1))
        return np.asarray(size // lowest >= np.uint64(_EXACT_IN_FLOAT))

    def scale(self, raw: NDArray[np.generic], out: Float64) -> None:
        """Write physical values (n), rounded where cantools rounds."""
        if self._exact is not None:
            factor, shift = self._exact
            product = raw.astype(np.int64) * np.int64(factor)
            out[:] = product + np.int64(shift)
            if not self._offset.is_integer():
                out += self._offset
            return
        with np.errstate(over="ignore"):  # bits that are a double near its end: infinite, as the codec says
            if self._scale == 1.0:
                out[:] = raw
            else:
                np.multiply(raw, self._scale, out=out)
            if self._offset:
                out += self._offset


def _exact_factors(signal: Signal) -> tuple[int, int] | None:
    """Return scale and offset of a signal that cantools scales in integers.

    None where floats are as exact.

    An offset that is no integer is none of these.
    """
    scale, offset = signal.scale, signal.offset
    whole = float(scale).is_integer() and float(offset).is_integer()
    if signal.is_float or not (whole or isinstance(scale, int)):
        return None
    shift = int(offset) if whole else 0
    span = 1 << (signal.length - 1 if signal.is_signed else signal.length)
    reach = abs(span * int(scale)) + abs(shift)
    return (int(scale), shift) if _EXACT_IN_FLOAT < reach < 1 << 63 else None
