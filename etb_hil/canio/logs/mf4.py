"""Bus logs in MF4 as columns of frames: only the bytes of a record that are wanted are looked at."""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.canio.frames import FrameBlock, FrameFlag, clear_behind, concatenate_frames
from etb_hil.canio.logs.mf4_blocks import DamagedError, Mf4Blocks, UnknownLayoutError

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
_ROWS = 1 << 13  # of a block of frames: their records stay in the processor's cache


class Mf4Reader:
    """An MF4 bus log, read anew by each iteration; afterwards `notes` says what could not be read.

    Files built in ways that we do not know (records of variable length, unsorted ones) are read by asammdf through
    python-can, slowly.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.notes: list[str] = []
        self.begin_ns: int | None = 0

    def __iter__(self) -> Iterator[FrameBlock]:
        """Yield the frames in order of time; InputError where the file cannot be read."""
        self.notes = []
        try:
            file = self._path.open("rb")
        except OSError as error:
            wrong = f"cannot be read: {error.strerror or error}"
            raise InputError(Problem(wrong, Place(self._path), remedy="check the path and its permissions")) from None
        with file:
            try:
                blocks = Mf4Blocks(file)
                start_ns, groups = blocks.start_ns(), blocks.groups()
            except UnknownLayoutError as error:
                yield from self._by_asammdf(str(error))
                return
            except DamagedError as error:
                remedy = "check that the file is whole, and what its name says"
                raise InputError(
                    Problem(f"is not readable as MF4: {error}", Place(self._path), remedy=remedy)
                ) from None
            yield from _in_order([self._frames(blocks, group, start_ns) for group in groups])

    def _frames(self, blocks: Mf4Blocks, group: FrameGroup, start_ns: int) -> Iterator[FrameBlock]:
        read = 0
        try:
            for records in blocks.records(group):
                for first in range(0, len(records), _ROWS):
                    part = records[first : first + _ROWS]
                    yield _block(part, group, start_ns)
                    read += len(part)
        except (DamagedError, UnknownLayoutError, zlib.error) as error:
            self.notes.append(f"{self._path}: {group.kind}: after frame {read}: {error}; nothing behind it was read")
        else:
            if read < group.count:
                self.notes.append(
                    f"{self._path}: {group.kind}: the file is cut off after frame {read} of {group.count}"
                )

    def _by_asammdf(self, reason: str) -> Iterator[FrameBlock]:
        from etb_hil.canio.logs.foreign import ForeignLog  # noqa: PLC0415 (importing can is slow)

        other = ForeignLog(self._path)
        try:
            yield from other
        except InputError as error:
            problem = Problem(f"{reason}; {error.problems[0].what}", Place(self._path), remedy=error.problems[0].remedy)
            raise InputError(problem) from None
        self.notes = other.notes


def _block(records: NDArray[np.uint8], group: FrameGroup, start_ns: int) -> FrameBlock:
    fields = {name.removeprefix(f"{group.kind}."): field for name, field in group.fields.items()}
    count = len(records)
    seconds = np.ascontiguousarray(records[:, fields[""].byte : fields[""].byte + 8]).view("<f8").ravel()
    if not (seconds.min() > -_LATEST_S and seconds.max() < _LATEST_S):  # nan, too
        raise DamagedError("a stamp is no time")
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
    return FrameBlock(
        stamp_ns,
        _numbers(records, fields.get("ID")).astype(np.uint32) & np.uint32(0x1FFFFFFF),
        flags,
        length,
        data,
        np.minimum(_numbers(records, fields.get("BusChannel")), 255).astype(np.uint8),
    )


def _numbers(records: NDArray[np.uint8], field: Field | None) -> NDArray[np.uint32] | NDArray[np.uint8]:
    """Return a whole number of at most 32 bits of each record, 0 where the records have none."""
    if field is None:
        return np.zeros(len(records), np.uint8)
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
    """Merge streams whose stamps rise by their stamps; of equal ones, the first stream's come first."""
    if len(sources) == 1:
        yield from sources[0]
        return
    heads = {index: block for index, source in enumerate(sources) if (block := next(source, None)) is not None}
    while heads:
        until = min(int(block.stamp_ns[-1]) for block in heads.values())
        parts = []
        for index, block in list(heads.items()):
            cut = int(np.searchsorted(block.stamp_ns, until, side="right"))
            parts.append(block.rows(slice(cut)))
            if cut < len(block):
                heads[index] = block.rows(slice(cut, None))
            elif (following := next(sources[index], None)) is not None:
                heads[index] = following
            else:
                del heads[index]
        merged = concatenate_frames(parts)
        yield merged.rows(np.argsort(merged.stamp_ns, kind="stable"))
