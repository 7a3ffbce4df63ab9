"""MF4 logs: frames as ASAM's bus logging has them, and decoded signals.

Signals have units and comments beside them.
"""

from __future__ import annotations

from typing import IO, TYPE_CHECKING

import numpy as np

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.canio.frames import FD_LENGTHS, FrameFlag
from etb_hil.canio.logs.mf4_file import BYTES, FLOAT, UNSIGNED, Channel, Mf4File

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from cantools.database.can import Message
    from numpy.typing import NDArray

    from etb_hil.canio.dbc.columns import MessageColumns
    from etb_hil.canio.frames import FrameBlock
    from etb_hil.canio.logs.mf4_file import Group

_SECOND_NS = 1_000_000_000
_ROWS = 8192  # of frames that are packed together: less than a megabyte
_SIGNAL_BYTES = 1 << 20  # of signals
_DLC_OF_LENGTH = np.array([next(d for d, n in enumerate(FD_LENGTHS) if n >= length) for length in range(65)], np.uint8)
_TIME = Channel("Timestamp", FLOAT, 0, 64, "s", is_time=True)
# The fields of a frame, with their bytes; the payload is written in words. Remote frames end before it.
_FIELDS = {
    "BusChannel": 1,
    "ID": 4,
    "IDE": 1,
    "DLC": 1,
    "DataLength": 1,
    "Dir": 1,
    "DataBytes": 64,
    "EDL": 1,
    "BRS": 1,
    "ESI": 1,
}
_DATA, _ERROR, _REMOTE = "CAN_DataFrame", "CAN_ErrorFrame", "CAN_RemoteFrame"


class Mf4Log:
    """An MF4 file of frames and decoded signals, complete once it is closed.

    Stamps are seconds after `start_ns`, rounded down to a second, in float64: exact to a nanosecond for a hundred days.
    Those before 1970 are negative.
    Raises InputError where the file cannot be written.
    """

    def __init__(self, path: Path, start_ns: int) -> None:
        self.left_out = 0
        self._start_ns = max(start_ns, 0) // _SECOND_NS * _SECOND_NS  # the header cannot hold a time before 1970
        try:
            self._opened: IO[bytes] = path.open("wb")
        except OSError as error:
            wrong = f"cannot be written: {error.strerror or error}"
            raise InputError(Problem(wrong, Place(path), remedy="give another path")) from None
        self._file = Mf4File(self._opened, self._start_ns)
        self._frames: dict[str, _FrameRecords] = {}
        self._signals: dict[tuple[str, int], _SignalRecords] = {}

    def write(self, frames: FrameBlock) -> None:
        """Take frames in the order in which they were seen.

        Groups of data, error and remote frames hold them.
        """
        error = (frames.flags & FrameFlag.ERROR) != 0
        remote = ~error & ((frames.flags & FrameFlag.REMOTE) != 0)
        if not (error.any() or remote.any()):
            self._extend(_DATA, frames)
            return
        for kind, rows in ((_DATA, ~error & ~remote), (_ERROR, error), (_REMOTE, remote)):
            if rows.any():
                self._extend(kind, frames.select(rows))

    def write_signals(self, found: Iterable[MessageColumns], messages: dict[str, Message], channel: int = 0) -> None:
        """Take decoded signals of a channel, with units and comments of the DBC file.

        Each message has a group of its name; on another channel than 0, of its name and the channel.
        """
        for part in found:
            records = self._signals.get((part.message, channel))
            if records is None:
                name = f"{part.message}, channel {channel}" if channel else part.message
                records = _SignalRecords(self._file, messages[part.message], name)
                self._signals[part.message, channel] = records
            records.write((part.stamp_ns - self._start_ns) / _SECOND_NS, list(part.columns.values()))

    def close(self) -> None:
        """Complete the file."""
        for frames in self._frames.values():
            frames.flush()
        for signals in self._signals.values():
            signals.flush()
        self._file.close()
        self._opened.close()

    def _extend(self, kind: str, frames: FrameBlock) -> None:
        records = self._frames.get(kind)
        if records is None:
            records = self._frames[kind] = _FrameRecords(self._file, kind)
        records.write((frames.stamp_ns - self._start_ns) / _SECOND_NS, frames)


class _FrameRecords:
    """The records of one kind of frames, packed `_ROWS` at a time."""

    def __init__(self, file: Mf4File, kind: str) -> None:
        self._file = file
        names = [name for name in _FIELDS if kind != _REMOTE or name not in {"DataBytes", "EDL", "BRS", "ESI"}]
        offsets, at = [], 8
        for name in names:
            offsets.append(at)
            at += _FIELDS[name]
        formats = {"ID": "<u4", "DataBytes": ("<u8", (8,))}
        self._records = np.zeros(
            _ROWS,
            np.dtype(
                {
                    "names": ["time", *names],
                    "formats": ["<f8", *(formats.get(name, "u1") for name in names)],
                    "offsets": [0, *offsets],
                    "itemsize": at,
                }
            ),
        )
        self._used = 0
        parts = [
            Channel(f"{kind}.{name}", BYTES if name == "DataBytes" else UNSIGNED, offset, 8 * _FIELDS[name])
            for name, offset in zip(names, offsets, strict=True)
        ]
        channels = (_TIME, Channel(kind, BYTES, 8, 8 * (at - 8), parts=parts))
        self._group: Group = file.group(kind, at, channels, is_bus=True)
        self._is_remote = kind == _REMOTE

    def write(self, seconds: NDArray[np.float64], frames: FrameBlock) -> None:
        first = 0
        while first < len(frames):
            count = min(len(frames) - first, _ROWS - self._used)
            part = slice(first, first + count)
            self._fill(self._records[self._used : self._used + count], seconds[part], frames.select(part))
            self._used += count
            first += count
            if self._used == _ROWS:
                self.flush()

    def flush(self) -> None:
        if self._used:
            self._file.write(self._group, self._records[: self._used].tobytes())
            self._used = 0

    def _fill(self, out: NDArray[np.void], seconds: NDArray[np.float64], frames: FrameBlock) -> None:
        flags, length = frames.flags, frames.length
        fd = (flags & FrameFlag.FD) != 0
        out["time"] = seconds
        out["BusChannel"], out["ID"], out["IDE"] = frames.channel, frames.ident, (flags & FrameFlag.EXTENDED) != 0
        out["DLC"] = np.where(fd, _DLC_OF_LENGTH[np.minimum(length, 64)], length) if fd.any() else length
        out["DataLength"] = 0 if self._is_remote else length
        out["Dir"] = (flags & FrameFlag.SENT) != 0
        if self._is_remote:
            return
        words = np.ascontiguousarray(frames.data).view(np.uint64)
        out["DataBytes"][:, : words.shape[1]] = words
        out["DataBytes"][:, words.shape[1] :] = 0
        out["EDL"], out["BRS"] = fd, (flags & FrameFlag.BITRATE_SWITCH) != 0
        out["ESI"] = (flags & FrameFlag.ERROR_STATE) != 0


class _SignalRecords:
    """The decoded signals of one message: records of float64."""

    def __init__(self, file: Mf4File, message: Message, name: str) -> None:
        self._file = file
        self._waiting: list[NDArray[np.float64]] = []
        self._bytes = 0
        channels = [
            Channel(signal.name, FLOAT, 8 * (1 + index), 64, signal.unit or "", signal.comment or "")
            for index, signal in enumerate(message.signals)
        ]
        self._group: Group = file.group(name, 8 * (1 + len(channels)), (_TIME, *channels), is_bus=False)

    def write(self, seconds: NDArray[np.float64], columns: list[NDArray[np.float64]]) -> None:
        records = np.column_stack([seconds, *columns])
        self._waiting.append(records)
        self._bytes += records.nbytes
        if self._bytes >= _SIGNAL_BYTES:
            self.flush()

    def flush(self) -> None:
        if self._waiting:
            self._file.write(self._group, np.concatenate(self._waiting).astype("<f8").tobytes())
            self._waiting, self._bytes = [], 0
