"""The blocks of an MDF 4 file (ASAM MDF 4.1).

They say where the frames of a bus log lie, and give their records in chunks.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import IO, TYPE_CHECKING

import numpy as np

from etb_hil.canio.logs.inflate import MOST_BYTES, inflate, inflate_in_parts

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

TIME = "\0"  # which no name in a file is
_HEAD = struct.Struct("<4s4xQQ")
_HEADER_AT = 64  # behind the identification
_BUS_EVENT, _BUS, _CAN = 2, 2, 2  # flag of a channel group, kind of its source, kind of its bus
_MASTER, _FIXED = 2, 0  # kinds of channel
_HIGHEST_BIT = 7
_WORD = 32  # bits of the widest number that is read
_UNSIGNED, _FLOAT, _BYTES = 0, 4, 10  # kinds of data, in Intel order
_LOCAL_TIME = 1
_OTHER_DATA = (b"##LD", b"##HL", b"##DL", b"##SD")  # which asammdf reads: lists in columns or in lists, signals' data
_LAST_METHOD = 5  # of packing, by version 4.3; from 2 on Zstandard and LZ4
_CHUNK_BYTES = 512 << 10
_LATEST_S = 5_000_000_000  # and as much again for the stamps is what 64 bits hold in nanoseconds
_BEYOND = 1 << 42  # no file is so long, and no system seeks much further
_MAX_BLOCKS = 1_000_000  # links of one block
_MAX_GROUPS = 1024  # each costs its share of every step of the merging
_MOST_HELD = 2 * MOST_BYTES  # of unpacked blocks, of which each group holds one


class UnknownLayoutError(Exception):
    """The file is built in a way that this reader does not know; another one may."""


class DamagedError(Exception):
    """The file is cut off or damaged."""


@dataclass(frozen=True, slots=True)
class Field:
    """Where a number, or an array of bytes, stands in a record."""

    byte: int
    bit: int
    bits: int
    kind: int


@dataclass(frozen=True, slots=True)
class FrameGroup:
    """One kind of frames, with the fields of a record by name.

    The kind is `CAN_DataFrame` and its like.
    """

    kind: str
    record_bytes: int
    count: int
    fields: dict[str, Field]
    data_at: int


class Mf4Blocks:
    """Reads blocks of an opened file; raises DamagedError or UnknownLayoutError."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self._size = size = file.seek(0, 2)
        # No block of the chains is part of two, no data belong to two blocks, and few blocks share a name: what breaks
        # this would let a small file be read for hours.
        self._seen: set[int] = set()
        self._data_left, self._about_left = size, 16 * size + MOST_BYTES
        self._held = 0
        if self._read(0, 8) != b"MDF     ":
            raise DamagedError("it must be an MDF file")

    def start_ns(self) -> int:
        """Return when the measurement began, in ns since 1970."""
        _, at, _ = self._links(_HEADER_AT)
        start, _, _, flags = struct.unpack("<QhhB", self._read(at, 13))
        if start // 1_000_000_000 >= _LATEST_S:
            raise DamagedError(f"it began at {start} ns")
        if not flags & _LOCAL_TIME:
            return int(start)
        moment = datetime(1970, 1, 1) + timedelta(seconds=start // 1_000_000_000)  # noqa: DTZ001 (the file's local time)
        return int(moment.timestamp()) * 1_000_000_000 + int(start % 1_000_000_000)

    def groups(self) -> list[FrameGroup]:
        """Return the groups that hold frames of CAN."""
        links, _, _ = self._links(_HEADER_AT)
        found = [group for at in self._chain((*links, 0)[0]) if (group := self._group(at)) is not None]
        if len(found) > _MAX_GROUPS:
            raise DamagedError(f"it has {len(found)} groups of frames, more than {_MAX_GROUPS}")
        return found

    def records(self, group: FrameGroup) -> Iterator[NDArray[np.uint8]]:
        """Yield the records of a group as uint8 (n, record bytes).

        A cut end gives fewer than `count`.
        """
        width = group.record_bytes
        rest: bytes | bytearray = b""
        left = group.count
        for part, columns in self._data(group.data_at):
            if columns == width and not rest:
                rows = min(len(part) // width, left)
                whole = len(part) // width
                yield np.frombuffer(part, np.uint8, whole * width).reshape(width, whole).T[:rows]
                rest = part[whole * width :]
            else:
                raw = rest + (_straight(part, columns) if columns else part)
                rows = min(len(raw) // width, left)
                yield np.frombuffer(raw, np.uint8, rows * width).reshape(rows, width)
                rest = raw[rows * width :]
            left -= rows
            if not left:
                return

    def _group(self, at: int) -> FrameGroup | None:
        links, data, _ = self._links(at)
        first, data_at = (*links, 0, 0, 0)[1:3]
        if not first:
            return None
        group, about, _ = self._links(first)
        group += (0,) * 4
        _, count, flags, _, data_bytes, invalid_bytes = struct.unpack("<QQHH4xII", self._read(about, 32))
        if not flags & _BUS_EVENT or not count or not group[3]:
            return None
        _, source, _ = self._links(group[3])
        if tuple(self._read(source, 2)) != (_BUS, _CAN):
            return None
        if self._read(data, 1)[0] or group[0]:
            raise UnknownLayoutError("its records are not sorted by group")
        fields: dict[str, Field] = {}
        self._channels(group[1], fields)
        kind = next((name for name in ("CAN_DataFrame", "CAN_ErrorFrame", "CAN_RemoteFrame") if name in fields), None)
        if kind is None:
            return None
        if TIME not in fields:
            raise UnknownLayoutError("its times must be numbers of 64 bits")
        if any(8 * field.byte + field.bit + field.bits > 8 * data_bytes for field in fields.values()):
            raise DamagedError("a channel lies outside its record")
        return FrameGroup(kind, data_bytes + invalid_bytes, count, fields, data_at)

    def _channels(self, first: int, fields: dict[str, Field], *, nested: bool = False) -> None:
        """Collect the channels of a group by name, that of time as `TIME`."""
        for at in self._chain(first):
            links, about, _ = self._links(at)
            links += (0,) * 5
            kind, _, data_kind, bit, byte, bits = struct.unpack("<BBBBII", self._read(about, 12))
            name = self._text(links[2])
            if bit > _HIGHEST_BIT:
                raise DamagedError(f"a channel starts at bit {bit} of a byte")
            if kind == _MASTER:
                if data_kind == _FLOAT and bits == 64 and not bit and not links[4]:
                    fields[TIME] = Field(byte, bit, bits, data_kind)
            elif kind == _FIXED and (
                data_kind == _BYTES or (data_kind == _UNSIGNED and not links[4] and bits <= _WORD)
            ):
                fields[name] = Field(byte, bit, bits, data_kind)
            elif name.startswith("CAN_"):
                raise UnknownLayoutError(f"the channel {name} is of another kind")
            if links[1] and not nested and self._read(links[1], 4) == b"##CN":
                self._channels(links[1], fields, nested=True)

    def _data(self, at: int, *, nested: bool = False) -> Iterator[tuple[bytes | bytearray, int]]:
        """Yield bytes of records, and of how many columns they are transposed, or 0."""
        name = self._read(at, 4) if at else b""
        if name == b"##HL" and not nested:
            at = (*self._links(at)[0], 0)[0]
            name = self._read(at, 4) if at else b""
        if name == b"##DL" and not nested:
            for each in self._chain(at):
                for link in self._links(each)[0][1:]:
                    yield from self._data(link, nested=True)
        elif name == b"##DZ":
            self._take_unseen(at)
            yield from self._inflated(at)
        elif name in {b"##DT", b"##DV"}:
            self._take_unseen(at)
            _, first, length = self._links(at)
            self._take_data(min(length, max(self._size - first, 0)))
            for start in range(first, first + length, _CHUNK_BYTES):
                part = self._file_part(start, min(_CHUNK_BYTES, first + length - start))
                if not part:
                    return  # cut off
                yield part, 0
        elif at:
            kind_of_error = UnknownLayoutError if name in _OTHER_DATA else DamagedError
            raise kind_of_error(f"its data lies in blocks of the kind {name!r}")

    def _inflated(self, at: int) -> Iterator[tuple[bytes | bytearray, int]]:
        _, first, _ = self._links(at)
        zipped, columns, size, packed = struct.unpack("<2xBxIQQ", self._read(first, 24))
        if max(size, packed) > MOST_BYTES or zipped > _LAST_METHOD:
            raise DamagedError(f"a block of {size} bytes is packed by method {zipped}")
        if zipped > 1:
            raise UnknownLayoutError(f"a block of {size} bytes is packed by method {zipped}")
        data = self._file_part(first + 24, packed)
        self._take_data(len(data))
        self._held += size
        if self._held > _MOST_HELD:
            raise DamagedError(f"its groups need blocks of {self._held} bytes at once")
        try:
            if zipped:
                yield inflate(data, size, cut=len(data) < packed), columns
            else:
                yield from ((part, 0) for part in inflate_in_parts(data, size))
        finally:
            self._held -= size

    def _chain(self, at: int) -> Iterator[int]:
        while at:
            self._take_unseen(at)
            yield at
            at = (*self._links(at)[0], 0)[0]

    def _take_unseen(self, at: int) -> None:
        if at in self._seen:
            raise DamagedError("its blocks go in circles")
        self._seen.add(at)

    def _take_data(self, size: int) -> None:
        self._data_left -= size
        if self._data_left < 0:
            raise DamagedError("its blocks of data overlap")

    def _links(self, at: int) -> tuple[tuple[int, ...], int, int]:
        """Return the links of a block, where its data starts and how long that is."""
        name, length, count = _HEAD.unpack(self._read(at, _HEAD.size))
        if name[:2] != b"##" or length < _HEAD.size + 8 * count or count > _MAX_BLOCKS:
            raise DamagedError(f"no block starts at byte {at}")
        links = struct.unpack(f"<{count}Q", self._read(at + _HEAD.size, 8 * count))
        return links, at + _HEAD.size + 8 * count, length - _HEAD.size - 8 * count

    def _text(self, at: int) -> str:
        if not at:
            return ""
        _, first, length = self._links(at)
        return self._read(first, min(length, 4096)).split(b"\0")[0].decode("utf-8", "replace")

    def _read(self, at: int, size: int) -> bytes:
        self._about_left -= size
        if self._about_left < 0:
            raise DamagedError("its blocks overlap")
        data = self._file_part(at, size)
        if len(data) < size:
            raise DamagedError(f"the file ends before byte {at + size}")
        return data

    def _file_part(self, at: int, size: int) -> bytes:
        if at >= _BEYOND:
            return b""
        self._file.seek(at)
        return self._file.read(size)


def _straight(part: bytes | bytearray, columns: int) -> bytes:
    """Return bytes that lay in transposed order as they were.

    What fills no row stands at the end.
    """
    rows = len(part) // columns
    matrix = np.frombuffer(part, np.uint8, rows * columns).reshape(columns, rows)
    return matrix.T.tobytes() + part[rows * columns :]
