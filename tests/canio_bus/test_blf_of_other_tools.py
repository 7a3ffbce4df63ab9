"""BLF files as Vector's tools write them: other objects between frames, headers of version 2, coarse stamps."""

import struct
import zlib

import can
import numpy as np
import pytest

from etb_hil.canio.frames import FrameFlag, concatenate_frames
from etb_hil.canio.logs.blf import read_blf

CAN_MESSAGE, CAN_STATISTIC, APP_TEXT, CAN_MESSAGE2, CAN_FD_64 = 1, 4, 65, 86, 101
TEN_MICROSECONDS, NANOSECONDS = 1, 2
START_NS = 1_763_600_000_000_000_000


def objects(kind, stamp, body, *, version=1, unit=NANOSECONDS, pad=4):
    head_size = 32 if version == 1 else 40
    size = head_size + len(body)
    head = struct.pack("<4sHHLL", b"LOBJ", head_size, version, size, kind)
    head += (
        struct.pack("<LHHQ", unit, 0, 0, stamp) if version == 1 else struct.pack("<LBxHQQ", unit, 0, 0, stamp, stamp)
    )
    return head + body + bytes(-size % pad)


def message(ident, data, *, flags=0, tail=b""):
    return struct.pack("<HBBL8s", 2, flags, len(data), ident, data) + tail


def fd_64(ident, data, *, flags=0x1000 | 0x2000):
    code = {8: 8, 12: 9, 64: 15}[len(data)]
    return struct.pack("<BBBBLLL16xHBBL", 3, code, len(data), 0, ident, 0, flags, 0, 0, 0, 0) + data


def container(content, *, stored):
    packed = content if stored else zlib.compress(content)
    size = 32 + len(packed)
    head = struct.pack("<4sHHLL", b"LOBJ", 16, 1, size, 10) + struct.pack("<H6xL4x", 0 if stored else 2, len(content))
    return head + packed + bytes(size % 4)


def write(path, content, *, stored=False, cut=10_000):
    day = (2025, 11, 4, 20, 0, 53, 20, 0)  # START_NS as SYSTEMTIME
    head = struct.pack("<4sLBBBBBBBBQQLL8H8H", b"LOGG", 144, 1, 13, 0, 0, 4, 5, 0, 0, 0, 0, 0, 0, *day, *day)
    parts = [content[k : k + cut] for k in range(0, len(content), cut)]
    path.write_bytes(head.ljust(144, b"\0") + b"".join(container(part, stored=stored) for part in parts))


@pytest.mark.parametrize("stored", [False, True])
@pytest.mark.parametrize("cut", [97, 10_000])
def test_frames_among_other_objects_are_found(tmp_path, stored, cut):
    content = b""
    for k in range(60):
        content += objects(CAN_MESSAGE, 1000 * k, message(0x123, bytes([k] * 8)), unit=TEN_MICROSECONDS)
        content += objects(CAN_STATISTIC, 1000 * k, bytes(24), unit=TEN_MICROSECONDS)
        content += objects(
            CAN_MESSAGE2, 10_000_000 * k + 5, message(0x80000124, bytes([k] * 3), flags=1, tail=bytes(8))
        )
        content += objects(APP_TEXT, 0, b"\0" * 16 + b"LOBJ in a text" + bytes(k % 7), version=2)
        content += objects(CAN_FD_64, 10_000_000 * k + 9, fd_64(0x125, bytes([k] * 12)), version=2)
    path = tmp_path / "vector.blf"
    write(path, content, stored=stored, cut=cut)
    reader = read_blf(path)
    frames = concatenate_frames(reader)
    assert reader.notes == []
    assert frames.ident.tolist() == [0x123, 0x124, 0x125] * 60
    after = frames.stamp_ns - frames.stamp_ns[0]
    np.testing.assert_array_equal(after, (np.arange(60)[:, None] * 10_000_000 + [0, 5, 9]).ravel())
    assert frames.length.tolist() == [8, 3, 12] * 60
    assert frames.channel.tolist() == [1, 1, 2] * 60
    expected = [0, FrameFlag.EXTENDED | FrameFlag.SENT, FrameFlag.FD | FrameFlag.BITRATE_SWITCH]
    assert frames.flags.tolist() == [int(flag) for flag in expected] * 60
    np.testing.assert_array_equal(frames.data[:, 0], np.repeat(np.arange(60), 3))
    with can.BLFReader(path) as peer:
        theirs = list(peer)
    assert [m.arbitration_id for m in theirs] == frames.ident.tolist()
    assert [bytes(m.data) for m in theirs] == [
        row.tobytes()[:length] for row, length in zip(frames.data, frames.length, strict=True)
    ]
