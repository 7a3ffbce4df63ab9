"""MDF 4 files (ASAM MDF 4.1) written in one go.

Groups of records grow, and are described when the file is closed.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import IO, TYPE_CHECKING

from etb_hil import __version__
from etb_hil.canio.logs.inflate import deflated

if TYPE_CHECKING:
    from collections.abc import Sequence

_HEAD = struct.Struct("<4s4xQQ")
_HEADER_AT = 64  # behind the identification
_UTC = 2  # the start is UTC, and its offset to local time, 0, is known
_MASTER, _TIME = 2, 1  # kind of channel, and what it is master of
_BUS_EVENT, _PLAIN_BUS_EVENT = 2, 4  # flags of a group
_BUS, _CAN = 2, 2  # kind of a source, and of its bus
_DEFLATE = 0
UNSIGNED, FLOAT, BYTES = 0, 4, 10  # kinds of data, in Intel order


@dataclass(frozen=True, slots=True)
class Channel:
    """One channel: its place in a record, its use, and the channels inside it."""

    name: str
    kind: int
    byte: int
    bits: int
    unit: str = ""
    comment: str = ""
    parts: Sequence[Channel] = ()
    is_time: bool = False


@dataclass(slots=True)
class Group:
    """Records of one shape. `is_bus` marks frames as ASAM's bus logging defines them."""

    name: str
    record_bytes: int
    channels: Sequence[Channel]
    is_bus: bool
    count: int = 0
    blocks: list[tuple[int, int]] = field(default_factory=list)  # where each begins, and its bytes


class Mf4File:
    """Write to an opened file; it is complete once `close` has been called.

    OSError where the disk refuses.
    """

    def __init__(self, file: IO[bytes], start_ns: int) -> None:
        self._file = file
        self._start_ns = start_ns
        self._groups: list[Group] = []
        self._at = 0
        identification = struct.pack("<8s8s8s4xH34x", b"MDF     ", b"4.10    ", b"etb_hil ", 410)
        self._append(identification)
        self._append(self._header(0, 0))

    def group(self, name: str, record_bytes: int, channels: Sequence[Channel], *, is_bus: bool) -> Group:
        """Return a new group."""
        self._groups.append(Group(name, record_bytes, channels, is_bus))
        return self._groups[-1]

    def write(self, group: Group, records: bytes) -> None:
        """Append whole records to a group."""
        group.count += len(records) // group.record_bytes
        packed = deflated(records)
        about = struct.pack("<2sBxIQQ", b"DT", _DEFLATE, 0, len(records), len(packed))
        group.blocks.append((self._block(b"##DZ", [], about + packed), len(records)))

    def close(self) -> None:
        """Describe the groups."""
        first_group = 0
        for group in reversed(self._groups):
            described = self._described(group)
            first_group = self._block(b"##DG", [first_group, described, self._data_of(group), 0], bytes(8))
        tool = f"<FHcomment><TX>written</TX><tool_id>etb_hil</tool_id><tool_vendor/><tool_version>{__version__}"
        about = self._block(b"##MD", [], f"{tool}</tool_version></FHcomment>".encode() + b"\0")
        history = self._block(b"##FH", [0, about], struct.pack("<QhhB3x", self._start_ns, 0, 0, _UTC))
        self._file.seek(_HEADER_AT)
        self._file.write(self._header(first_group, history))

    def _header(self, first_group: int, history: int) -> bytes:
        links = struct.pack("<6Q", first_group, history, 0, 0, 0, 0)
        start = struct.pack("<QhhBBBxdd", self._start_ns, 0, 0, _UTC, 0, 0, 0.0, 0.0)
        return _HEAD.pack(b"##HD", _HEAD.size + len(links) + len(start), 6) + links + start

    def _described(self, group: Group) -> int:
        name = self._text(group.name)
        source, flags = 0, 0
        if group.is_bus:
            bus = self._text("CAN")
            source = self._block(b"##SI", [bus, bus, 0], struct.pack("<BBB5x", _BUS, _CAN, 0))
            flags = _BUS_EVENT | _PLAIN_BUS_EVENT
        channels = self._channels(group.channels, source)
        about = struct.pack("<QQHHIII", 0, group.count, flags, ord("."), 0, group.record_bytes, 0)
        return self._block(b"##CG", [0, channels, name, source, 0, name], about)

    def _channels(self, channels: Sequence[Channel], source: int) -> int:
        following = 0
        for channel in reversed(channels):
            links = [
                following, self._channels(channel.parts, source), self._text(channel.name), source, 0, 0,
                self._text(channel.unit), self._text(channel.comment),
            ]  # fmt: skip
            kind = (_MASTER, _TIME) if channel.is_time else (0, 0)
            about = struct.pack(
                "<BBBBIIIIBxH6d", *kind, channel.kind, 0, channel.byte, channel.bits, 0, 0, 0, 0, *[0.0] * 6
            )
            following = self._block(b"##CN", links, about)
        return following

    def _data_of(self, group: Group) -> int:
        if not group.blocks:
            return 0
        offsets, offset = [], 0
        for _, size in group.blocks:
            offsets.append(offset)
            offset += size
        count = len(offsets)
        about = struct.pack(f"<B3xI{count}Q", 0, count, *offsets)
        listed = self._block(b"##DL", [0, *(at for at, _ in group.blocks)], about)
        return self._block(b"##HL", [listed], struct.pack("<HB5x", 0, _DEFLATE))

    def _text(self, text: str) -> int:
        return self._block(b"##TX", [], text.encode() + b"\0") if text else 0

    def _block(self, name: bytes, links: list[int], data: bytes) -> int:
        """Append a block, aligned to 8 bytes, and return where it starts."""
        at = self._at
        size = _HEAD.size + 8 * len(links) + len(data)
        self._append(_HEAD.pack(name, size, len(links)) + struct.pack(f"<{len(links)}Q", *links) + data)
        return at

    def _append(self, data: bytes) -> None:
        padding = -len(data) % 8
        self._file.write(data)
        self._file.write(bytes(padding))
        self._at += len(data) + padding
