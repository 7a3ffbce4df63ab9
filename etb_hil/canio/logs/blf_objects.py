"""CAN objects of Vector's Binary Logging Format to and from columns of frames, whole blocks at a time.

There is no public specification; layouts follow what python-can reads and writes. An object is a header of 32 bytes
(40 in version 2) and a body; the next one starts up to 4 bytes of padding behind its end.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from etb_hil.canio.frames import FD_LENGTHS, FrameBlock, FrameFlag

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Bytes = NDArray[np.uint8]
    Offsets = NDArray[np.int64]
    Rows = slice | NDArray[np.bool_]

SIGNATURE = b"LOBJ"
CAN_MESSAGE, CAN_ERROR_EXT, CAN_MESSAGE2, CAN_FD_MESSAGE, CAN_FD_MESSAGE_64 = 1, 73, 86, 100, 101
MAX_PADDING = 4

HEADER = np.dtype(
    [
        ("signature", "S4"), ("header_size", "<u2"), ("version", "<u2"), ("size", "<u4"), ("type", "<u4"),
        ("flags", "<u4"), ("client", "<u2"), ("object_version", "<u2"), ("stamp", "<u8"),
    ]
)  # fmt: skip
_HEADER_BYTES = {1: 32, 2: 40}
_TEN_MICROSECONDS, _ONE_NANOSECOND = 1, 2  # unit of the stamp, in the header's flags

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
_PAYLOAD = np.dtype([("data", "u1", 64)])  # behind a CAN_FD_MESSAGE_64, often shorter
_BODIES = {
    CAN_MESSAGE: _MESSAGE,
    CAN_MESSAGE2: _MESSAGE,
    CAN_FD_MESSAGE: _FD,
    CAN_FD_MESSAGE_64: _FD_64,
    CAN_ERROR_EXT: _ERROR,
}

_SENT, _REMOTE = 0x01, 0x80  # flags of a message
_EDL, _BRS, _ESI = 1, 2, 4  # fd_flags of CAN_FD_MESSAGE
_REMOTE_64, _EDL_64, _BRS_64, _ESI_64 = 0x0010, 0x1000, 0x2000, 0x4000  # fd_flags of CAN_FD_MESSAGE_64
_ID_EXTENDED = 0x80000000

_KEPT = np.where(np.arange(64) < np.arange(65)[:, None], 255, 0).astype(np.uint8).view(np.uint64)  # bytes of a payload
_LENGTH_OF_DLC = np.array(FD_LENGTHS, np.uint8)
_DLC_OF_LENGTH = np.array([next(d for d, n in enumerate(FD_LENGTHS) if n >= length) for length in range(65)], np.uint8)


def pack(frames: FrameBlock, start_ns: int) -> bytes:
    """Return frames as objects, their stamps in nanoseconds from `start_ns`."""
    error = (frames.flags & FrameFlag.ERROR) != 0
    fd = ~error & ((frames.flags & FrameFlag.FD) != 0)
    kinds = ((CAN_MESSAGE, ~error & ~fd), (CAN_FD_MESSAGE, fd), (CAN_ERROR_EXT, error))
    parts = [(rows, _objects(frames.rows(rows), kind, start_ns)) for kind, rows in kinds if rows.any()]
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


def unpack(data: Bytes, starts: Offsets, start_ns: int) -> FrameBlock:
    """Return the frames among the objects that start at `starts` (n) in `data`; other objects are left out.

    `data` ends at least 64 bytes behind the last object.
    """
    head = _gather(data, starts, HEADER)
    version, kind = head["version"], head["type"]
    body_at = starts + np.where(version == 2, _HEADER_BYTES[2], _HEADER_BYTES[1])
    room = np.where((version == 1) | (version == 2), starts + head["size"] - body_at, 0)
    present = [number for number in _BODIES if (kind == number).any()]
    is_frame = np.zeros(len(starts), np.bool_)
    for number in present:
        is_frame |= (kind == number) & (room >= _BODIES[number].itemsize)
    if not is_frame.all():
        head, starts, body_at, kind = head[is_frame], starts[is_frame], body_at[is_frame], kind[is_frame]
    count = len(head)
    step = np.where(head["flags"] == _TEN_MICROSECONDS, np.int64(10_000), np.int64(1))
    fd = CAN_FD_MESSAGE in present or CAN_FD_MESSAGE_64 in present
    frames = FrameBlock(
        head["stamp"].astype(np.int64) * step + start_ns,
        np.zeros(count, np.uint32),
        np.zeros(count, np.uint8),
        np.zeros(count, np.uint8),
        np.zeros((count, 64 if fd else 8), np.uint8),
        np.zeros(count, np.uint8),
    )
    for number in present:
        mask = kind == number
        rows: Rows = slice(None) if mask.all() else mask  # a view where a mask would copy
        at = body_at[rows]
        body = _gather(data, at, _BODIES[number])
        if number == CAN_FD_MESSAGE_64:
            _fill(frames, rows, number, body, _payload_behind(data, body, starts[rows], at, head["size"][rows]))
        else:
            _fill(frames, rows, number, body, body["data"])
    return frames


def _payload_behind(
    data: Bytes, body: NDArray[np.void], starts: Offsets, body_at: Offsets, size: NDArray[np.uint32]
) -> Bytes:
    """Return the payload (n, 64) that follows a CAN_FD_MESSAGE_64, zero where the object ends before."""
    first = body_at + _FD_64.itemsize
    end = starts + np.where(body["extension"] == 0, size, body["extension"])
    payload = _gather(data, first, _PAYLOAD)["data"]
    return (payload.view(np.uint64) & _KEPT[np.clip(end - first, 0, 64)]).view(np.uint8)


def _fill(frames: FrameBlock, rows: Rows, kind: int, body: NDArray[np.void], payload: Bytes) -> None:
    """Write the bodies of one kind of object into their rows of `frames`."""
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
    if kind in (CAN_FD_MESSAGE, CAN_FD_MESSAGE_64):
        length = np.where(remote, _LENGTH_OF_DLC[np.minimum(length, 15)], body["valid"])
    length = np.minimum(length, payload.shape[1])
    there = np.where(remote, 0, length)
    width = min(payload.shape[1], frames.data.shape[1])
    words = payload.view(np.uint64)  # eight bytes at a time
    frames.data[rows, :width] = (words & _KEPT[:, : words.shape[1]].take(there, axis=0)).view(np.uint8)[:, :width]
    frames.length[rows] = length
    frames.flags[rows] = flags | _bits(body["id"], _ID_EXTENDED, FrameFlag.EXTENDED)
    frames.ident[rows] = body["id"] & np.uint32(0x1FFFFFFF)
    frames.channel[rows] = np.clip(body["channel"], 1, 256) - 1


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
    return np.where(word & mask, np.uint8(flag), np.uint8(0))


def _gather(data: Bytes, starts: Offsets, layout: np.dtype[np.void]) -> NDArray[np.void]:
    """Return the structures that start at any byte."""
    step = int(starts[1] - starts[0]) if len(starts) > 1 else 0
    if step > 0 and bool((np.diff(starts) == step).all()):  # a log of one kind of frame: nothing to copy
        return np.ndarray((len(starts),), layout, data, int(starts[0]), (step,))
    # One copy each, out of a view whose items overlap.
    overlapping = np.ndarray((len(data) - layout.itemsize + 1,), f"V{layout.itemsize}", data, strides=(1,))
    return overlapping[starts].view(layout)
