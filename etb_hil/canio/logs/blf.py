"""The raw log, in Vector's Binary Logging Format.

The log is written so that a killed process leaves a file that can be read.

The file starts with its start time, and every flush hands whole containers to the operating system. python-can's
writer writes the start time at the end and one frame at a time.
"""

from __future__ import annotations

import os
import struct
import zlib
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.errors import BenchFault, InputError, Place, Problem, RecordingFault
from etb_hil.base.userfile import open_file
from etb_hil.canio.frames import FrameBlock, concatenate_frames
from etb_hil.canio.logs.blf_chain import MAX_PADDING, SIGNATURE, find_objects
from etb_hil.canio.logs.blf_objects import FRAME_KINDS, MARGIN, NEVER, pack, unpack
from etb_hil.canio.logs.inflate import MOST_BYTES, inflate
from etb_hil.canio.logs.notes import Notes

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

# Signature, header size, application, its version, the format's version, file size, size unpacked, objects, objects
# read, start and stop as SYSTEMTIME (year, month, weekday, day, hour, minute, second, millisecond).
_FILE_HEADER = struct.Struct("<4sLBBBBBBBBQQLL8H8H")
_FILE_HEADER_BYTES = 144
_FORMAT_VERSION = (2, 6, 8, 1)
_APPLICATION = 5  # python-can writes the same number; those known belong to Vector's tools

_OBJECT = struct.Struct("<4sHHLL")
_CONTAINER = struct.Struct("<H6xL4x")
_CONTAINER_TYPE = 10
_STORED, _DEFLATED = 0, 2
_LEVEL = 1  # the default level takes twice as long for a tenth less

_ROWS = 2048  # frames a container: 100 to 240 KB, which stays in the processor's cache
_PARSE_BYTES = 1 << 20
_MILLISECOND_NS = 1_000_000
_HEAD_START_NS = 1_000_000_000


class BlfLog:
    """A BLF file that grows while frames arrive.

    `start_ns` (ns since 1970) is when the log is opened. The header's start is a second earlier, rounded down to a
    millisecond: a driver may hold frames from before. Stamps are kept to the nanosecond. Raises BenchFault where the
    disk refuses; what was half written is cut off.
    """

    def __init__(self, path: Path, start_ns: int) -> None:
        self._path = path
        early = max(start_ns - _HEAD_START_NS, 0)
        self.start_ns = early - early % _MILLISECOND_NS
        self._stop_ns = self.start_ns
        self._waiting: list[FrameBlock] = []
        self._rows = self._objects = 0
        self._unpacked = _FILE_HEADER_BYTES
        try:
            self._file = path.open("wb", buffering=0)
        except OSError as error:
            raise self._refused(error) from error
        self._size = 0
        self._append(self._header())

    def write(self, frames: FrameBlock) -> None:
        """Take frames in the order in which they were seen.

        Full containers go to the file.
        """
        if not len(frames):
            return
        if (oldest_ns := int(np.minimum.reduce(frames.stamp_ns))) < self.start_ns:
            raise BenchFault(
                f"{self._path}: a frame of {oldest_ns} ns is older than the log, which starts at "
                f"{self.start_ns} ns; hand the log a time on the clock of the bus"
            )
        self._waiting.append(frames)
        self._rows += len(frames)
        if self._rows >= _ROWS:
            self.flush()

    def flush(self) -> None:
        """Hand all that was written to the operating system, as whole containers."""
        frames = concatenate_frames(self._waiting)
        self._waiting, self._rows = [], 0
        for first in range(0, len(frames), _ROWS):
            part = frames.select(slice(first, first + _ROWS))
            objects = pack(part, self.start_ns)
            packed = zlib.compress(objects, _LEVEL)
            size = _OBJECT.size + _CONTAINER.size + len(packed)
            head = _OBJECT.pack(SIGNATURE, _OBJECT.size, 1, size, _CONTAINER_TYPE)
            self._append(head + _CONTAINER.pack(_DEFLATED, len(objects)) + packed + bytes(size % 4))
            self._objects += len(part)
            self._unpacked += _OBJECT.size + _CONTAINER.size + len(objects)
            self._stop_ns = max(self._stop_ns, int(part.stamp_ns.max()))

    def close(self) -> None:
        """Flush, complete the header with size, count and stop time, and close."""
        if self._file.closed:
            return
        try:
            self.flush()
            self._file.seek(0)
            self._file.write(self._header())
        except OSError as error:
            raise self._refused(error) from error
        finally:
            self._file.close()

    def _header(self) -> bytes:
        size = max(self._size, _FILE_HEADER_BYTES)
        return _FILE_HEADER.pack(
            b"LOGG", _FILE_HEADER_BYTES, _APPLICATION, 0, 0, 0, *_FORMAT_VERSION,
            size, self._unpacked, self._objects, 0, *_system_time(self.start_ns), *_system_time(self._stop_ns),
        ).ljust(_FILE_HEADER_BYTES, b"\0")  # fmt: skip

    def _append(self, data: bytes) -> None:
        try:
            written = self._file.write(data)
            while written < len(data):
                written += self._file.write(data[written:])
        except OSError as error:
            os.ftruncate(self._file.fileno(), self._size)
            self._file.seek(self._size)
            raise self._refused(error) from error
        self._size += len(data)

    def _refused(self, error: OSError) -> RecordingFault:
        return RecordingFault(f"{self._path}: the raw log cannot be written: {error.strerror}; check the disk's space")


class BlfReader:
    """A BLF file, read anew by each iteration in blocks of bounded size.

    `notes` says afterwards what was broken.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.notes: list[str] = []
        self.begin_ns: int | None = 0
        self.start_ns = 0
        self._frames = 0
        self._broken = Notes()

    def __iter__(self) -> Iterator[FrameBlock]:
        """Yield the frames in the file's order; InputError where it is no BLF file at all."""
        self.notes, self._frames, self._broken = [], 0, Notes()
        yield from self._blocks()
        self.notes = self._broken.told()

    def _blocks(self) -> Iterator[FrameBlock]:
        tail, parts, size = b"", [], 0
        for inflated in self._containers():
            if inflated is not None:
                parts.append(inflated)
                size += len(inflated)
                if size < _PARSE_BYTES:
                    continue
            frames, tail = self._parse([tail, *parts])
            parts, size = [], 0
            if inflated is None:
                tail = b""  # what follows does not go on with the object that was cut
            if len(frames):
                yield frames
        frames, tail = self._parse([tail, *parts])
        if len(frames):
            yield frames
        if len(tail) > MAX_PADDING:
            self._note(None, f"the last object is cut off ({len(tail)} bytes of it are left)")

    def _containers(self) -> Iterator[bytes | bytearray | None]:
        """Yield the inflated bytes of each container, None where one is missing."""
        with open_file(self._path) as file:
            self._read_header(file.read(_FILE_HEADER.size))
            position = self._header_bytes
            while True:
                file.seek(position)
                head = file.read(_OBJECT.size)
                if len(head) < _OBJECT.size:
                    if head:
                        self._note(position, "the file is cut off here")
                    elif position < self._size:
                        self._note(position, f"the file ends here, and its header says {self._size} bytes")
                    return
                signature, _, _, size, kind = _OBJECT.unpack(head)
                if signature != SIGNATURE or size < _OBJECT.size:
                    self._note(position, "no object starts here; nothing behind it was read")
                    return
                is_read = kind == _CONTAINER_TYPE and size <= MOST_BYTES
                if kind == _CONTAINER_TYPE and not is_read:
                    self._note(position, f"a container of {size} bytes was left out")
                    yield None
                if kind in FRAME_KINDS:
                    self._note(position, "a frame outside of a container was left out")
                body = file.read(size - _OBJECT.size) if is_read else b""
                cut = is_read and len(body) < size - _OBJECT.size
                if cut:
                    self._note(position, "the last container is cut off; what it still holds was read")
                if len(body) >= _CONTAINER.size:
                    yield self._inflate(body, position, cut=cut)
                position += size + size % 4

    def _read_header(self, raw: bytes) -> None:
        if len(raw) < _FILE_HEADER.size or raw[:4] != b"LOGG":
            raise InputError(
                Problem("must be a BLF file", Place(self._path), remedy="give a log with the ending of its format")
            )
        header = _FILE_HEADER.unpack(raw)
        self._header_bytes = max(int(header[1]), _FILE_HEADER.size)
        self._size = int(header[10])  # not the final one while the file is written, and less than what is there
        year, month, _, day, hour, minute, second, millisecond = header[14:22]
        try:
            start = datetime(year, month, day, hour, minute, second, tzinfo=UTC)
        except ValueError:  # unset
            start = None
        if start is None or not _EPOCH <= start < _LATEST:  # stamps count from zero
            self.start_ns = 0
        else:
            seconds = (start - _EPOCH) // timedelta(seconds=1)
            self.start_ns = seconds * 1_000_000_000 + millisecond * _MILLISECOND_NS

    def _inflate(self, body: bytes, position: int, *, cut: bool) -> bytes | bytearray | None:
        method, claimed = _CONTAINER.unpack_from(body)
        data = memoryview(body)[_CONTAINER.size :]
        if method == _STORED:
            return bytes(data)
        if method != _DEFLATED or claimed > MOST_BYTES:
            self._note(position, f"a container of method {method} and {claimed} bytes was left out")
            return None
        try:
            return inflate(data, claimed, cut=cut)
        except zlib.error as error:
            self._note(position, f"a container is damaged and was left out ({error})")
            return None

    def _parse(self, parts: list[bytes | bytearray]) -> tuple[FrameBlock, bytes]:
        """Return the frames of whole objects in bytes, and what of them goes on behind."""
        data = b"".join([*parts, bytes(MARGIN)])
        length = len(data) - MARGIN
        objects = find_objects(data, length, lambda text: self._note(None, text))
        frames, counts = unpack(np.frombuffer(data, np.uint8), objects, self.start_ns)
        for what, count in counts.items():
            self._note(None, f"{count} {what}")
        if (never := frames.stamp_ns == NEVER).any():
            frames = frames.select(~never)
            self._note(None, f"{np.count_nonzero(never)} frames stamped after the year 2255 were left out")
        self._frames += len(frames)
        return frames, data[objects.end : length]

    def _note(self, position: int | None, text: str) -> None:
        where = "" if position is None else f" at byte {position}"
        self._broken.add(f"{self._path}: after frame {self._frames}{where}", text)


def read_blf(path: Path) -> BlfReader:
    """Open a BLF file.

    Iterated, it yields its frames as FrameBlocks with stamps exact to the nanosecond.

    A broken end or a damaged container costs only itself, and `notes` says where it was. Raises InputError, on
    iteration, where the file cannot be read or is no BLF file.
    """
    return BlfReader(path)


_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_LATEST = datetime(2200, 1, 1, tzinfo=UTC)  # no log is later, and 64 bits of ns hold centuries of stamps from there


def _system_time(time_ns: int) -> tuple[int, ...]:
    moment = _EPOCH + timedelta(milliseconds=time_ns // _MILLISECOND_NS)
    weekday = moment.isoweekday() % 7
    return (
        moment.year, moment.month, weekday, moment.day, moment.hour, moment.minute, moment.second,
        moment.microsecond // 1000,
    )  # fmt: skip
