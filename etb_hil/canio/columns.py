"""All signals of a DBC file as columns, in numpy alone: for exports and for a look into a log, without compiling.

The values are cantools', bit for bit. What judges a unit goes through `decoder.py`, which checks and clocks frames too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.canio.frames import FrameFlag

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from cantools.database.can import Message, Signal
    from numpy.typing import NDArray

    from etb_hil.canio.frames import FrameBlock

    Float64 = NDArray[np.float64]
    Bytes = NDArray[np.uint8]

_WORD = 8
_FEW = 64  # messages up to which a comparison each is cheaper than sorting all frames
_EXTENDED = 0x80000000
_NO_DATA = FrameFlag.REMOTE | FrameFlag.ERROR
_FLOATS = {16: np.uint16, 32: np.uint32, 64: np.uint64}
_FLOAT_OF = {16: np.float16, 32: np.float32, 64: np.float64}


@dataclass(frozen=True, slots=True)
class MessageColumns:
    """The frames of one message: `stamp_ns` (n), and each signal's physical values (n), NaN where multiplexed out."""

    message: str
    stamp_ns: NDArray[np.int64]
    columns: Mapping[str, Float64]


class ColumnDecoder:
    """Decodes the frames of some messages of a DBC file, whole blocks at a time.

    Frames that are too short for their message are left out and counted in `too_short`.
    """

    def __init__(self, messages: Iterable[Message], id_offset: int = 0) -> None:
        self._readers = {
            (m.frame_id + id_offset) | (_EXTENDED if m.is_extended_frame else 0): _MessageReader(m)
            for m in messages
            if not m.is_container
        }
        self.too_short = 0

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
                rows = rows[whole]  # noqa: PLW2901 (what is left of them)
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
    def __init__(self, message: Message) -> None:
        self.length = message.length
        self._name = message.name
        self._signals = [_SignalReader(signal, short=message.length <= _WORD) for signal in message.signals]
        self._reach = max((reader.reach for reader in self._signals), default=0)
        self._parents = {signal.name: signal for signal in message.signals}

    def read(self, data: Bytes, stamp_ns: NDArray[np.int64]) -> MessageColumns:
        if self._reach > data.shape[1]:  # a word that starts late reads beyond the payload
            padded = np.zeros((len(data), self._reach), np.uint8)
            padded[:, : data.shape[1]] = data
        else:
            padded = data
        words: dict[tuple[int, str], NDArray[np.uint64]] = {}
        raw = {reader.signal.name: reader.raw(padded, words) for reader in self._signals}
        columns = {}
        for reader in self._signals:
            with np.errstate(invalid="ignore"):  # a payload may spell a NaN that signals
                values = reader.scaled(raw[reader.signal.name])
            active = self._active(reader.signal, raw)
            columns[reader.signal.name] = values if active is None else np.where(active, values, np.nan)
        return MessageColumns(self._name, stamp_ns, columns)

    def _active(self, signal: Signal, raw: Mapping[str, NDArray[np.generic]]) -> NDArray[np.bool_] | None:
        """Return in which frames a signal's multiplexers choose it; None where it has none."""
        active = None
        while signal.multiplexer_signal:
            chosen = np.isin(raw[signal.multiplexer_signal], np.array(signal.multiplexer_ids or [], np.int64))
            active = chosen if active is None else active & chosen
            signal = self._parents[signal.multiplexer_signal]
        return active


class _SignalReader:
    """Reads one signal: eight bytes of each payload as a word, and the few bits of a ninth."""

    def __init__(self, signal: Signal, *, short: bool) -> None:
        self.signal = signal
        self._motorola = signal.byte_order == "big_endian"
        start, length = signal.start, signal.length
        self._first = 0 if short else start // 8  # one word serves all signals of a classic frame
        # Bits of the word, from its low end or from its top, that are others'.
        self._skip = (start // 8 - self._first) * 8 + (7 - start % 8 if self._motorola else start % 8)
        self._ninth = max(0, self._skip + length - 64)
        self.reach = self._first + _WORD + (1 if self._ninth else 0)

    def raw(self, padded: Bytes, words: dict[tuple[int, str], NDArray[np.uint64]]) -> NDArray[np.generic]:
        """Return the bits as an integer with its sign, or as a float; `words` keeps what several signals read."""
        length = self.signal.length
        order = ">u8" if self._motorola else "<u8"
        word = words.get((self._first, order))
        if word is None:
            # Eight bytes at any place in a row, without copying them as bytes first.
            there = np.ndarray((len(padded),), order, padded, self._first, (padded.shape[1],))
            word = words[self._first, order] = there.astype(np.uint64)
        if self._motorola:
            bits = word << np.uint64(self._skip) >> np.uint64(64 - min(length, 64 - self._skip))
            if self._ninth:
                rest = padded[:, self._first + _WORD].astype(np.uint64) >> np.uint64(8 - self._ninth)
                bits = bits << np.uint64(self._ninth) | rest
        else:
            bits = word >> np.uint64(self._skip)
            if self._ninth:
                bits |= padded[:, self._first + _WORD].astype(np.uint64) << np.uint64(64 - self._skip)
        if length < 64:
            bits &= np.uint64((1 << length) - 1)
        if self.signal.is_float:
            return bits.astype(_FLOATS[length]).view(_FLOAT_OF[length])
        if self.signal.is_signed:
            room = np.int64(64 - length)
            return bits.view(np.int64) << room >> room
        return bits.view(np.int64) if length < 64 else bits

    def scaled(self, raw: NDArray[np.generic]) -> Float64:
        """Return physical values (n), rounded where cantools rounds."""
        signal = self.signal
        scale, offset = signal.scale, signal.offset
        if (scale, offset) == (1, 0) or signal.is_float:
            values = raw.astype(np.float64)
            return values if (scale, offset) == (1, 0) else values * float(scale) + float(offset)
        whole = float(scale).is_integer() and float(offset).is_integer()
        if whole or isinstance(scale, int):
            shift = int(offset) if whole else 0
            span = 1 << signal.length
            if abs(span * int(scale)) + abs(shift) < 1 << 63:
                product = raw.astype(np.int64) * np.int64(int(scale))
                return (product + np.int64(shift)).astype(np.float64) if whole else product.astype(np.float64) + offset
        return raw.astype(np.float64) * float(scale) + float(offset)
