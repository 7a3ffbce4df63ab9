"""CAN objects of BLF to and from columns of frames, whole blocks at a time.

BLF is Vector's Binary Logging Format.

There is no public specification; layouts follow what python-can reads and writes, and what is known of those that it
passes over (error frames of old tools and of FD channels). An object is a header of 32 bytes
(40 in version 2) and a body; the next one starts up to 4 bytes of padding behind its end.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from etb_hil.canio.frames import FD_LENGTHS, FrameBlock, FrameFlag, clear_behind
from etb_hil.canio.logs.blf_chain import SIGNATURE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from etb_hil.canio.logs.blf_chain import Objects

    Bytes = NDArray[np.uint8]
    Offsets = NDArray[np.int64]
    Rows = slice | NDArray[np.intp]
    Odd = tuple[str, NDArray[np.intp]]  # what is said of some rows

CAN_MESSAGE, CAN_MESSAGE2, CAN_FD_MESSAGE, CAN_FD_MESSAGE_64 = 1, 86, 100, 101
CAN_ERROR, CAN_ERROR_EXT, CAN_FD_ERROR_64 = 2, 73, 104

HEADER = np.dtype(
    [
        ("signature", "S4"), ("header_size", "<u2"), ("version", "<u2"), ("size", "<u4"), ("type", "<u4"),
        ("flags", "<u4"), ("client", "<u2"), ("object_version", "<u2"), ("stamp", "<u8"),
    ]
)  # fmt: skip
_HEADER_BYTES = {1: 32, 2: 40}
_TEN_MICROSECONDS, _ONE_NANOSECOND = 1, 2  # unit of the stamp, in the header's flags
NEVER = np.iinfo(np.int64).min  # in place of a stamp that is too late
_LATEST_NS = 9 * 10**18  # after 1970, in the year 2255: about what 64 bits hold

_MESSAGE = np.dtype([("channel", "<u2"), ("flags", "u1"), ("dlc", "u1"), ("id", "<u4"), ("data", "u1", 8)])
_FD = np.dtype(
    [
        ("channel", "<u2"), ("flags", "u1"), ("dlc", "u1"), ("id", "<u4"), ("frame_length", "<u4"), ("bits", "u1"),
        ("fd_flags", "u1"), ("valid", "u1"), ("reserved", "V5"), ("data", "u1", 64),
    ]
)  # fmt: skip
_FD_64 = np.dtype(
    [
        ("channel", "u1"), ("dlc", "u1"), ("valid", "u1"), ("count", "u1"), ("id", "<u4"), ("frame_length", "<u4"),
        ("fd_flags", "<u4"), ("rates", "V16"), ("bits", "<u2"), ("direction", "u1"), ("extension", "u1"),
        ("crc", "<u4"),
    ]
)  # fmt: skip
_ERROR = np.dtype(
    [
        ("channel", "<u2"), ("length", "<u2"), ("flags", "<u4"), ("ecc", "u1"), ("position", "u1"), ("dlc", "u1"),
        ("reserved", "V1"), ("frame_length", "<u4"), ("id", "<u4"), ("flags_ext", "<u2"), ("reserved2", "V2"),
        ("data", "u1", 8),
    ]
)  # fmt: skip
_OLD_ERROR = np.dtype([("channel", "<u2"), ("length", "<u2")])
_ERROR_64 = np.dtype(
    [
        ("channel", "u1"), ("dlc", "u1"), ("valid", "u1"), ("ecc", "u1"), ("flags", "<u2"), ("code", "<u2"),
        ("fd_flags", "<u2"), ("extension", "u1"), ("reserved", "u1"), ("id", "<u4"),
    ]
)  # fmt: skip
_PAYLOAD = np.dtype([("data", "u1", 64)])  # behind a CAN_FD_MESSAGE_64, often shorter
_BODIES = {
    CAN_MESSAGE: _MESSAGE,
    CAN_MESSAGE2: _MESSAGE,
    CAN_FD_MESSAGE: _FD,
    CAN_FD_MESSAGE_64: _FD_64,
    CAN_ERROR_EXT: _ERROR,
    CAN_ERROR: _OLD_ERROR,
    CAN_FD_ERROR_64: _ERROR_64,
}
FRAME_KINDS = frozenset(_BODIES)
# Bytes of a body up to its payload, the least that an object may have: some tools write no more of a payload than the
# frame has.
_LEAST = {
    kind: body.itemsize - (body["data"].itemsize if "data" in (body.names or ()) else 0)
    for kind, body in _BODIES.items()
}
_WIDE = (CAN_FD_MESSAGE, CAN_FD_MESSAGE_64)
_MAX_CHANNEL = 256  # as the objects count them, from 1
MARGIN = _PAYLOAD.itemsize

# What is said of frames, with their number in front.
FAR = "frames on channels above 255 were left out"
UNKNOWN = "frames were left out: their objects are too short, or the version of their header is neither 1 nor 2"
DAMAGED = "frames were left out: they announce more payload than their objects have"
PADDED = "CAN FD frames announce more payload than their objects have; zeros stand for the rest, as in Vector's tools"

_SENT, _REMOTE = 0x01, 0x80  # flags of a message
_EDL, _BRS, _ESI = 1, 2, 4  # fd_flags of CAN_FD_MESSAGE
_REMOTE_64, _EDL_64, _BRS_64, _ESI_64 = 0x0010, 0x1000, 0x2000, 0x4000  # fd_flags of CAN_FD_MESSAGE_64
_ID_EXTENDED = 0x80000000
_OF_OTHER_KINDS = np.uint8(FrameFlag.ERROR | FrameFlag.FD)

_LENGTH_OF_DLC = np.array(FD_LENGTHS, np.uint8)
_DLC_OF_LENGTH = np.array([next(d for d, n in enumerate(FD_LENGTHS) if n >= length) for length in range(65)], np.uint8)


def pack(frames: FrameBlock, start_ns: int) -> bytes:
    """Return frames as objects, their stamps in nanoseconds from `start_ns`."""
    if not (frames.flags & _OF_OTHER_KINDS).any():  # as most blocks are
        return _objects(frames, CAN_MESSAGE, start_ns).tobytes()
    error = (frames.flags & FrameFlag.ERROR) != 0
    fd = ~error & ((frames.flags & FrameFlag.FD) != 0)
    kinds = ((CAN_MESSAGE, ~error & ~fd), (CAN_FD_MESSAGE, fd), (CAN_ERROR_EXT, error))
    parts = [(rows, _objects(frames.select(rows), kind, start_ns)) for kind, rows in kinds if rows.any()]
    if len(parts) == 1:
        return parts[0][1].tobytes()
    size = np.zeros(len(frames), np.int64)
    for rows, objects in parts:
        size[rows] = objects.itemsize
    offset = np.cumsum(size) - size
    out = np.empty(int(size.sum()), np.uint8)
    for rows, objects in parts:
        out[offset[rows, None] + np.arange(objects.itemsize)] = objects.view(np.uint8).reshape(len(objects), -1)
    return out.tobytes()


def _objects(frames: FrameBlock, kind: int, start_ns: int) -> NDArray[np.void]:
    layout = np.dtype([("head", HEADER), ("body", _BODIES[kind])])
    objects = np.zeros(len(frames), layout)
    head, body, flags = objects["head"], objects["body"], frames.flags
    head["signature"], head["header_size"], head["version"] = SIGNATURE, HEADER.itemsize, 1
    head["size"], head["type"], head["flags"] = layout.itemsize, kind, _ONE_NANOSECOND
    head["stamp"] = frames.stamp_ns - start_ns
    body["channel"] = frames.channel + np.uint16(1)
    body["id"] = frames.ident | np.where(flags & FrameFlag.EXTENDED, np.uint32(_ID_EXTENDED), np.uint32(0))
    body["dlc"] = frames.length
    width = min(body["data"].shape[1], frames.data.shape[1])
    body["data"][:, :width] = frames.data[:, :width]
    if kind == CAN_ERROR_EXT:
        return objects
    body["flags"] = _bits(flags, FrameFlag.SENT, _SENT) | _bits(flags, FrameFlag.REMOTE, _REMOTE)
    if kind == CAN_FD_MESSAGE:
        body["dlc"] = _DLC_OF_LENGTH[frames.length]
        body["valid"] = frames.length
        switch, state = _bits(flags, FrameFlag.BITRATE_SWITCH, _BRS), _bits(flags, FrameFlag.ERROR_STATE, _ESI)
        body["fd_flags"] = _EDL | switch | state
    return objects


def unpack(data: Bytes, objects: Objects, start_ns: int) -> tuple[FrameBlock, dict[str, int]]:
    """Return the frames among objects in `data`, and what is said of how many.

    `data` ends `MARGIN` bytes behind the last object.

    Objects of other kinds are left out. So are frames that cannot be decoded or that no column holds: they are counted
    under `FAR`, `UNKNOWN` or `DAMAGED`. Frames that are kept with zeros in their payload are counted under `PADDED`.
    """
    starts, step = objects.starts, objects.step
    head = _gather(data, starts, HEADER, step)
    groups, unknown = _groups(head)
    odd: list[Odd] = []
    wide = any(group.kind in _WIDE for group in groups)
    if len(groups) == 1 and groups[0].rows is None:  # views where gathering would copy
        frames = _frames(head, start_ns, wide=wide)
        _fill(frames, slice(None), groups[0], head["size"], data, starts, step, odd)
        return _without(frames, odd, unknown)
    place = None  # of each object among the frames
    if sum(len(group.rows) for group in groups) < len(starts):
        is_frame = np.zeros(len(starts), np.bool_)
        for group in groups:
            is_frame[group.rows] = True
        place, head = np.cumsum(is_frame) - 1, head[is_frame]
    frames = _frames(head, start_ns, wide=wide)
    for group in groups:
        rows = group.rows if place is None else place[group.rows]
        _fill(frames, rows, group, head["size"].take(rows), data, starts.take(group.rows), 0, odd)
    return _without(frames, odd, unknown)


def _without(frames: FrameBlock, odd: list[Odd], unknown: int) -> tuple[FrameBlock, dict[str, int]]:
    """Return the frames that are kept, and what is said of how many."""
    counts = {UNKNOWN: unknown} if unknown else {}
    if not odd:
        return frames, counts
    kept = np.ones(len(frames), np.bool_)
    for what, rows in odd:
        if len(rows):
            counts[what] = counts.get(what, 0) + len(rows)
        kept[rows] &= what == PADDED
    return frames.select(kept), counts


@dataclass(frozen=True, slots=True)
class _Group:
    """Objects of one kind and one version of the header, which are the same within."""

    kind: int
    head_bytes: int
    rows: Any  # NDArray[np.intp], or None where they are all objects that there are


def _groups(head: NDArray[np.void]) -> tuple[list[_Group], int]:
    """Return the objects that are frames, and how many more cannot be decoded."""
    kind, version, size = head["type"], head["version"], head["size"]
    groups = []
    if len(head) and (kind == kind[0]).all() and (version == version[0]).all():
        body, head_bytes = _BODIES.get(int(kind[0])), _HEADER_BYTES.get(int(version[0]))
        if body is None or head_bytes is None:
            return [], 0 if body is None else len(head)
        if int(size.min()) >= head_bytes + _LEAST[int(kind[0])]:
            return [_Group(int(kind[0]), head_bytes, None)], 0
    unknown = 0
    for number, least in _LEAST.items():
        there = kind == number
        if there.any():
            unknown += int(np.count_nonzero(there))
            for key, head_bytes in _HEADER_BYTES.items():
                rows = np.flatnonzero(there & (version == key) & (size >= head_bytes + least))
                if len(rows):
                    groups.append(_Group(number, head_bytes, rows))
                    unknown -= len(rows)
    return groups, unknown


def _frames(head: NDArray[np.void], start_ns: int, *, wide: bool) -> FrameBlock:
    """Return frames with their stamps alone.

    They are `NEVER` where one is later than 64 bits hold.
    """
    count = len(head)
    stamp_ns, latest = head["stamp"].astype(np.int64), np.uint64(_LATEST_NS - start_ns)
    is_never = head["stamp"] > latest
    coarse = head["flags"] == _TEN_MICROSECONDS
    if coarse.any():
        stamp_ns *= np.where(coarse, np.int64(10_000), np.int64(1))
        is_never |= coarse & (head["stamp"] > latest // np.uint64(10_000))
    stamp_ns += start_ns
    stamp_ns[is_never] = NEVER
    return FrameBlock(
        stamp_ns,
        np.empty(count, np.uint32),
        np.empty(count, np.uint8),
        np.empty(count, np.uint8),
        np.empty((count, 64 if wide else 8), np.uint8),
        np.empty(count, np.uint8),
    )


def _fill(
    frames: FrameBlock,
    rows: Rows,
    group: _Group,
    size: NDArray[np.uint32],
    data: Bytes,
    starts: Offsets,
    step: int,
    odd: list[Odd],
) -> None:
    """Write the objects of a group into their rows of `frames`.

    Rows that are not as announced go to `odd`, with what is said of them.
    """
    kind = group.kind
    body_at = starts + group.head_bytes
    body = _gather(data, body_at, _BODIES[kind], step)
    odd += _fill_channels(frames, rows, body["channel"])
    if kind in (CAN_ERROR, CAN_FD_ERROR_64):
        frames.flags[rows], frames.ident[rows] = FrameFlag.ERROR, 0
        frames.length[rows], frames.data[rows] = 0, 0
        return
    payload, room = _payload(group, data, body, body_at, size)
    width, flags = payload.shape[1], _flags(kind, body)
    remote = (flags & FrameFlag.REMOTE) != 0
    has_remote = bool(remote.any())
    length = body["valid"] if kind in _WIDE else np.minimum(body["dlc"], width)
    if kind in _WIDE and has_remote:
        length = np.where(remote, _LENGTH_OF_DLC[np.minimum(body["dlc"], 15)], length)
    there = np.where(remote, 0, length) if has_remote else length
    if int(there.max()) > np.min(room):
        odd += _short_of_payload(kind, np.arange(len(frames))[rows], there, room)
        length, there = np.minimum(length, width), np.minimum(there, width)
    shortest, longest = int(there.min()), int(there.max())
    if shortest < longest:
        payload = payload.copy()
        clear_behind(payload, there)
    words, out = payload.view(np.uint64), frames.data.view(np.uint64)  # eight bytes at a time
    if shortest == longest < width:
        words = words.copy()
        words.view(np.uint8)[:, longest:] = 0
    if words.shape[1] == out.shape[1]:
        out[rows] = words
    else:
        out[rows, : words.shape[1]] = words
        out[rows, words.shape[1] :] = 0
    frames.length[rows] = length
    frames.flags[rows] = flags | _bits(body["id"], _ID_EXTENDED, FrameFlag.EXTENDED)
    frames.ident[rows] = body["id"] & np.uint32(0x1FFFFFFF)


def _fill_channels(frames: FrameBlock, rows: Rows, channel: NDArray[np.integer[Any]]) -> list[Odd]:
    """Write the channels, which objects count from 1.

    Return the rows of those that do not fit, if there are any.
    """
    frames.channel[rows] = np.maximum(channel, 1) - 1
    if channel.max(initial=0) <= _MAX_CHANNEL:
        return []
    return [(FAR, np.arange(len(frames))[rows][channel > _MAX_CHANNEL])]


def _short_of_payload(
    kind: int, rows: NDArray[np.intp], length: NDArray[np.integer[Any]], room: Offsets | int
) -> list[Odd]:
    """Return the rows whose payload is longer than the room for it."""
    is_short = length > room
    is_kept = (length <= _PAYLOAD.itemsize) & (kind == CAN_FD_MESSAGE_64)
    return [(PADDED, rows[is_short & is_kept]), (DAMAGED, rows[is_short & ~is_kept])]


def _payload(
    group: _Group, data: Bytes, body: NDArray[np.void], body_at: Offsets, size: NDArray[np.uint32]
) -> tuple[Bytes, Offsets | int]:
    """Return the payload (n, 8 or 64), and how many bytes of it the objects have.

    The latter is one number where all have the same, or (n).
    """
    least = group.head_bytes + _LEAST[group.kind]
    if group.kind != CAN_FD_MESSAGE_64:
        width = int(body["data"].shape[1])
        return body["data"], width if int(size.min()) >= least + width else size.astype(np.int64) - least
    # A block may follow, at an offset that the body announces.
    end = np.where(body["extension"] == 0, size, np.minimum(body["extension"], size)).astype(np.int64)
    room = np.clip(end - least, 0, _PAYLOAD.itemsize)
    payload = _gather(data, body_at + _FD_64.itemsize, _PAYLOAD, 0)["data"]
    clear_behind(payload, room)
    return payload, room


def _flags(kind: int, body: NDArray[np.void]) -> Bytes:
    if kind == CAN_ERROR_EXT:
        return np.full(len(body), FrameFlag.ERROR, np.uint8)
    if kind == CAN_FD_MESSAGE_64:
        return _flags_of_fd_64(body)
    flags = _flags_of_message(body)
    return flags | _flags_of_fd(body) if kind == CAN_FD_MESSAGE else flags


def _flags_of_message(body: NDArray[np.void]) -> Bytes:
    return _bits(body["flags"], _SENT, FrameFlag.SENT) | _bits(body["flags"], _REMOTE, FrameFlag.REMOTE)


def _flags_of_fd(body: NDArray[np.void]) -> Bytes:
    word = body["fd_flags"]
    fd, switch = _bits(word, _EDL, FrameFlag.FD), _bits(word, _BRS, FrameFlag.BITRATE_SWITCH)
    return fd | switch | _bits(word, _ESI, FrameFlag.ERROR_STATE)


def _flags_of_fd_64(body: NDArray[np.void]) -> Bytes:
    word = body["fd_flags"]
    fd, switch = _bits(word, _EDL_64, FrameFlag.FD), _bits(word, _BRS_64, FrameFlag.BITRATE_SWITCH)
    state, remote = _bits(word, _ESI_64, FrameFlag.ERROR_STATE), _bits(word, _REMOTE_64, FrameFlag.REMOTE)
    return fd | switch | state | remote | _bits(body["direction"], 0xFF, FrameFlag.SENT)


def _bits(word: NDArray[np.integer[Any]], mask: int, flag: int) -> Bytes:
    found = word & mask
    if not found.any():
        return np.zeros(len(word), np.uint8)
    return np.where(found, np.uint8(flag), np.uint8(0))


def _gather(data: Bytes, starts: Offsets, layout: np.dtype[np.void], step: int) -> NDArray[np.void]:
    """Return the structures that start at any byte, or every `step` bytes."""
    if step:
        return np.ndarray((len(starts),), layout, data, int(starts[0]), (step,))
    # One copy each, out of a view whose items overlap.
    overlapping = np.ndarray((len(data) - layout.itemsize + 1,), f"V{layout.itemsize}", data, strides=(1,))
    return overlapping[starts].view(layout)
