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
_WIDE = (CAN_FD_MESSAGE, CAN_FD_MESSAGE_64)
_MAX_CHANNEL = 256  # as the objects count them, from 1
MARGIN = _PAYLOAD.itemsize

_SENT, _REMOTE = 0x01, 0x80  # flags of a message
_EDL, _BRS, _ESI = 1, 2, 4  # fd_flags of CAN_FD_MESSAGE
_REMOTE_64, _EDL_64, _BRS_64, _ESI_64 = 0x0010, 0x1000, 0x2000, 0x4000  # fd_flags of CAN_FD_MESSAGE_64
_ID_EXTENDED = 0x80000000

_LENGTH_OF_DLC = np.array(FD_LENGTHS, np.uint8)
_DLC_OF_LENGTH = np.array([next(d for d, n in enumerate(FD_LENGTHS) if n >= length) for length in range(65)], np.uint8)


def pack(frames: FrameBlock, start_ns: int) -> bytes:
    """Return frames as objects, their stamps in nanoseconds from `start_ns`."""
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


def unpack(data: Bytes, objects: Objects, start_ns: int) -> tuple[FrameBlock, int]:
    """Return the frames among objects in `data`; others are left out.

    `data` ends `MARGIN` bytes behind the last object.

    So are frames on channels that no column holds; the second result is how many.
    """
    starts, step = objects.starts, objects.step
    head = _gather(data, starts, HEADER, step)
    groups = _groups(head)
    far: list[NDArray[np.intp]] = []
    wide = any(group.kind in _WIDE for group in groups)
    if len(groups) == 1 and groups[0].rows is None:  # views where gathering would copy
        frames = _frames(head, start_ns, wide=wide)
        _fill(frames, slice(None), groups[0], head["size"], data, starts, step, far)
        return _without(frames, far)
    place = None  # of each object among the frames
    if sum(len(group.rows) for group in groups) < len(starts):
        is_frame = np.zeros(len(starts), np.bool_)
        for group in groups:
            is_frame[group.rows] = True
        place, head = np.cumsum(is_frame) - 1, head[is_frame]
    frames = _frames(head, start_ns, wide=wide)
    for group in groups:
        rows = group.rows if place is None else place[group.rows]
        _fill(frames, rows, group, head["size"].take(rows), data, starts.take(group.rows), 0, far)
    return _without(frames, far)


def _without(frames: FrameBlock, far: list[NDArray[np.intp]]) -> tuple[FrameBlock, int]:
    """Return the frames but some rows, and how many those are."""
    if not far:
        return frames, 0
    near = np.ones(len(frames), np.bool_)
    near[np.concatenate(far)] = False
    return frames.select(near), int(np.count_nonzero(~near))


@dataclass(frozen=True, slots=True)
class _Group:
    """Objects of one kind and one version of the header, which are the same within."""

    kind: int
    head_bytes: int
    rows: Any  # NDArray[np.intp], or None where they are all objects that there are


def _groups(head: NDArray[np.void]) -> list[_Group]:
    """Return the objects that are whole frames."""
    kind, version, size = head["type"], head["version"], head["size"]
    groups = []
    if len(head) and (kind == kind[0]).all() and (version == version[0]).all():
        body, head_bytes = _BODIES.get(int(kind[0])), _HEADER_BYTES.get(int(version[0]))
        if body is None or head_bytes is None:
            return []
        if int(size.min()) >= head_bytes + body.itemsize:
            return [_Group(int(kind[0]), head_bytes, None)]
    for number, body in _BODIES.items():
        there = kind == number
        if there.any():
            for key, head_bytes in _HEADER_BYTES.items():
                mask = there & (version == key) & (size >= head_bytes + body.itemsize)
                if mask.any():
                    groups.append(_Group(number, head_bytes, np.flatnonzero(mask)))
    return groups


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
    far: list[NDArray[np.intp]],
) -> None:
    """Write the objects of a group into their rows of `frames`.

    Those on channels beyond a column's go to `far`.
    """
    kind = group.kind
    body_at = starts + group.head_bytes
    body = _gather(data, body_at, _BODIES[kind], step)
    far += _fill_channels(frames, rows, body["channel"])
    if kind in (CAN_ERROR, CAN_FD_ERROR_64):
        frames.flags[rows], frames.ident[rows] = FrameFlag.ERROR, 0
        frames.length[rows], frames.data[rows] = 0, 0
        return
    payload = _payload_behind(data, body, starts, body_at, size) if kind == CAN_FD_MESSAGE_64 else body["data"]
    length = body["dlc"]
    if kind == CAN_ERROR_EXT:
        flags = np.full(len(body), FrameFlag.ERROR, np.uint8)
    elif kind == CAN_FD_MESSAGE_64:
        flags = _flags_of_fd_64(body)
    elif kind == CAN_FD_MESSAGE:
        flags = _flags_of_message(body) | _flags_of_fd(body)
    else:
        flags = _flags_of_message(body)
    remote = (flags & FrameFlag.REMOTE) != 0
    has_remote = bool(remote.any())
    if kind in _WIDE:
        codes, length = length, body["valid"]
        if has_remote:
            length = np.where(remote, _LENGTH_OF_DLC[np.minimum(codes, 15)], length)
    width = payload.shape[1]
    length = np.minimum(length, width)
    there = np.where(remote, 0, length) if has_remote else length
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


def _fill_channels(frames: FrameBlock, rows: Rows, channel: NDArray[np.integer[Any]]) -> list[NDArray[np.intp]]:
    """Write the channels, which objects count from 1.

    Return the rows of those that do not fit, if there are any.
    """
    frames.channel[rows] = np.maximum(channel, 1) - 1
    if channel.max(initial=0) <= _MAX_CHANNEL:
        return []
    return [np.arange(len(frames))[rows][channel > _MAX_CHANNEL]]


def _payload_behind(
    data: Bytes, body: NDArray[np.void], starts: Offsets, body_at: Offsets, size: NDArray[np.uint32]
) -> Bytes:
    """Return the payload (n, 64) that follows a CAN_FD_MESSAGE_64.

    The payload is zero where the object ends before.
    """
    first = body_at + _FD_64.itemsize
    end = starts + np.where(body["extension"] == 0, size, body["extension"])
    payload = _gather(data, first, _PAYLOAD, 0)["data"]
    clear_behind(payload, np.clip(end - first, 0, 64))
    return payload


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
