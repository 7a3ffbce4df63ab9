"""Bus logs in MF4 as columns of frames.

Only the bytes of a record that are wanted are looked at.
"""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.userfile import open_file
from etb_hil.canio.frames import FrameBlock, FrameFlag, clear_behind, concatenate_frames
from etb_hil.canio.logs.asammdf_frames import frames_by_asammdf
from etb_hil.canio.logs.mf4_blocks import TIME, DamagedError, Mf4Blocks, UnknownLayoutError
from etb_hil.canio.logs.notes import Notes

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from etb_hil.canio.logs.mf4_blocks import Field, FrameGroup

_FLAGS = {
    "IDE": FrameFlag.EXTENDED,
    "EDL": FrameFlag.FD,
    "BRS": FrameFlag.BITRATE_SWITCH,
    "ESI": FrameFlag.ERROR_STATE,
    "Dir": FrameFlag.SENT,
}
_KINDS = {"CAN_DataFrame": 0, "CAN_ErrorFrame": int(FrameFlag.ERROR), "CAN_RemoteFrame": int(FrameFlag.REMOTE)}
_LATEST_S = 4e9  # after the start, which may be as late: what 64 bits hold in nanoseconds
_MAX_CHANNEL, _WIDEST = 255, 32
_FAR = f"frames on channels above {_MAX_CHANNEL} were left out"
_ROWS = 1 << 13  # of a block of frames: their records stay in the processor's cache


class Mf4Reader:
    """An MF4 bus log, read anew by each iteration.

    Afterwards `notes` says what could not be read.

    Files built in ways that we do not know (records of variable length, unsorted ones, other ways of packing) are read
    by asammdf through python-can, slowly. A way that shows only behind the first frames ends the reading of its group.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.notes: list[str] = []
        self.begin_ns: int | None = 0
        self._is_begun = False

    def __iter__(self) -> Iterator[FrameBlock]:
        """Yield the frames in order of time; InputError where the file cannot be read."""
        self.notes, self._is_begun = [], False
        try:
            with open_file(self._path) as file:
                blocks = Mf4Blocks(file)
                start_ns, groups = blocks.start_ns(), blocks.groups()
                for frames in _in_order([self._frames(blocks, group, start_ns) for group in groups]):
                    self._is_begun = True
                    yield frames
        except UnknownLayoutError as error:
            self.notes = []
            yield from self._by_asammdf(str(error))
        except DamagedError as error:
            remedy = "check that the file is whole, and what its name says"
            raise InputError(Problem(f"is not readable as MF4: {error}", Place(self._path), remedy=remedy)) from None

    def _frames(self, blocks: Mf4Blocks, group: FrameGroup, start_ns: int) -> Iterator[FrameBlock]:
        read, notes = 0, Notes()
        try:
            for records in blocks.records(group):
                for first in range(0, len(records), _ROWS):
                    part = records[first : first + _ROWS]
                    frames, far = _block(part, group, start_ns)
                    if far:
                        notes.add(self._path, f"{group.kind}: {far} {_FAR}", _FAR)
                    yield frames
                    read += len(part)
        except (DamagedError, UnknownLayoutError, zlib.error) as error:
            if isinstance(error, UnknownLayoutError) and not self._is_begun:
                raise  # asammdf reads all of it
            self.notes.append(f"{self._path}: {group.kind}: after frame {read}: {error}; nothing behind it was read")
        else:
            if read < group.count:
                self.notes.append(
                    f"{self._path}: {group.kind}: the file is cut off after frame {read} of {group.count}"
                )
        self.notes += notes.told()

    def _by_asammdf(self, reason: str) -> Iterator[FrameBlock]:
        try:
            yield from frames_by_asammdf(self._path, self.notes)
        except InputError as error:
            problem = Problem(f"{reason}; {error.problems[0].what}", Place(self._path), remedy=error.problems[0].remedy)
            raise InputError(problem) from None


def _block(records: NDArray[np.uint8], group: FrameGroup, start_ns: int) -> tuple[FrameBlock, int]:
    """Return the frames in records, and how many are on too high channels.

    No column holds the latter.
    """
    fields = {name.removeprefix(f"{group.kind}."): field for name, field in group.fields.items()}
    count = len(records)
    seconds = np.ascontiguousarray(records[:, fields[TIME].byte : fields[TIME].byte + 8]).view("<f8").ravel()
    if not (seconds.min() > -_LATEST_S and seconds.max() < _LATEST_S):  # nan, too
        raise DamagedError("a time stamp must be a finite number")
    stamp_ns = np.rint(seconds * 1e9).astype(np.int64)
    stamp_ns += start_ns
    flags = np.full(count, _KINDS[group.kind], np.uint8)
    for name, flag in _FLAGS.items():
        if name in fields:
            found = _numbers(records, fields[name])
            if found.any():
                flags |= np.where(found, np.uint8(flag), np.uint8(0))
    remote = group.kind == "CAN_RemoteFrame"
    length = _numbers(records, fields.get("DLC" if remote else "DataLength")).astype(np.uint8)
    data = np.zeros((count, 8), np.uint8)
    there = fields.get("DataBytes")
    if there is not None and not remote:
        length = np.minimum(length, min(there.bits // 8, 64))
        longest = int(length.max(initial=0))
        if longest > 8:
            data = np.zeros((count, 64), np.uint8)
        data[:, :longest] = records[:, there.byte : there.byte + longest]
        if int(length.min(initial=64)) < longest:
            clear_behind(data, length)
    elif not remote:
        length = np.zeros(count, np.uint8)
    channel = _numbers(records, fields.get("BusChannel"))
    frames = FrameBlock(
        stamp_ns,
        _numbers(records, fields.get("ID")).astype(np.uint32) & np.uint32(0x1FFFFFFF),
        flags,
        length,
        data,
        channel.astype(np.uint8),
    )
    if int(channel.max(initial=0)) <= _MAX_CHANNEL:
        return frames, 0
    near = channel <= _MAX_CHANNEL
    return frames.select(near), int(np.count_nonzero(~near))


def _numbers(records: NDArray[np.uint8], field: Field | None) -> NDArray[np.uint32] | NDArray[np.uint8]:
    """Return a whole number (32 bits at most) of each record, 0 where there is none."""
    if field is None:
        return np.zeros(len(records), np.uint8)
    if field.bits > _WIDEST:
        raise DamagedError(f"a number has {field.bits} bits")
    size = -(-(field.bit + field.bits) // 8)
    if size == 1:
        return records[:, field.byte] >> np.uint8(field.bit) & np.uint8((1 << field.bits) - 1)
    if size == 4 and not field.bit and field.bits == 32:
        return np.ascontiguousarray(records[:, field.byte : field.byte + 4]).view("<u4").ravel()
    word = np.zeros(len(records), np.uint64)
    for place in range(size):
        word |= records[:, field.byte + place].astype(np.uint64) << np.uint64(8 * place)
    return ((word >> np.uint64(field.bit)) & np.uint64((1 << field.bits) - 1)).astype(np.uint32)


def _in_order(sources: list[Iterator[FrameBlock]]) -> Iterator[FrameBlock]:
    """Merge streams by their stamps; of equal ones, the first stream's come first.

    A frame whose stamp lies before that of an earlier one of its stream stays behind that one.
    """
    if len(sources) == 1:
        yield from sources[0]
        return
    keyed = [_keyed(source) for source in sources]
    heads = {index: head for index, source in enumerate(keyed) if (head := next(source, None)) is not None}
    while heads:
        until = min(int(keys[-1]) for _, keys in heads.values())
        parts, part_keys = [], []
        for index, (block, keys) in list(heads.items()):
            cut = int(np.searchsorted(keys, until, side="right"))
            parts.append(block.select(slice(cut)))
            part_keys.append(keys[:cut])
            if cut < len(block):
                heads[index] = block.select(slice(cut, None)), keys[cut:]
            elif (following := next(keyed[index], None)) is not None:
                heads[index] = following
            else:
                del heads[index]
        yield concatenate_frames(parts).select(np.argsort(np.concatenate(part_keys), kind="stable"))


def _keyed(source: Iterator[FrameBlock]) -> Iterator[tuple[FrameBlock, NDArray[np.int64]]]:
    """Yield blocks, each with the latest stamp up to every frame (n).

    That stamp never falls.
    """
    latest = np.int64(np.iinfo(np.int64).min)
    for block in source:
        keys = np.maximum(np.maximum.accumulate(block.stamp_ns), latest)
        latest = keys[-1]
        yield block, keys
