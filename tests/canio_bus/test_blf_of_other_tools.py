"""BLF files as Vector's tools write them: other objects between frames, headers of version 2, coarse stamps."""

import struct
import zlib

import can
import numpy as np
import pytest

from etb_hil.canio.frames import FrameFlag, concatenate_frames
from etb_hil.canio.logs.blf import read_blf
from etb_hil.canio.messages import from_messages

CAN_MESSAGE, CAN_ERROR, CAN_STATISTIC, APP_TRIGGER, ENV_INTEGER, APP_TEXT = 1, 2, 4, 5, 6, 65
REAL_TIME_CLOCK, CAN_ERROR_EXT, CAN_MESSAGE2, CAN_FD, CAN_FD_64, CAN_FD_ERROR_64 = 51, 73, 86, 100, 101, 104
EVENT_COMMENT, GLOBAL_MARKER, RESTORE_POINTS = 92, 96, 115
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


def fd(ident, data, *, flags=0, fd_flags=1):
    code = {8: 8, 48: 14, 64: 15}[len(data)]
    return struct.pack("<HBBLLBBB5x", 1, flags, code, ident, 0, 0, fd_flags, len(data)) + data.ljust(64, b"\xa5")


def error_ext(ident, data):
    return struct.pack("<HHLBBBxLLHH", 1, 0, 0, 0, 0, len(data), 0, ident, 0, 0) + data.ljust(8, b"\0")


def vector_log(rng, count, *, other=True):
    """The objects of a measurement as CANoe and CANalyzer write it, those of the frames that python-can knows apart."""
    content = objects(EVENT_COMMENT, 0, struct.pack("<L4xQ", 0, 4) + b"test", version=1, pad=1)
    for k in range(count):
        ident, data = int(rng.integers(0, 0x800)), rng.bytes(8)
        stamp = 1_000_000 * k
        kind = int(rng.integers(0, 8))
        if kind < 2:
            content += objects(CAN_MESSAGE2, stamp, message(ident, data, tail=struct.pack("<LBBH", 230_000, 111, 0, 0)))
        elif kind == 2:  # a remote frame on an extended identifier, sent by the tool
            content += objects(CAN_MESSAGE2, stamp, message(ident | 1 << 31, b"", flags=0x81, tail=bytes(8)))
        elif kind == 3:
            content += objects(CAN_FD_64, stamp, fd_64(ident, rng.bytes(64)) + b"\x11" * 8, version=2)
        elif kind == 4:  # with the block that tools append behind the payload, which its offset announces
            body = bytearray(fd_64(ident, rng.bytes(12)) + struct.pack("<LL", 7, 9))
            body[35] = 32 + 40 + 12
            content += objects(CAN_FD_64, stamp, bytes(body))
        elif kind == 5:
            content += objects(CAN_FD, stamp, fd(ident, rng.bytes(48), flags=1, fd_flags=3))
        elif kind == 6:
            content += objects(CAN_ERROR_EXT, stamp, error_ext(ident, rng.bytes(3)))
        else:
            content += objects(CAN_MESSAGE, stamp // 10_000, message(ident, data), unit=TEN_MICROSECONDS)
        if other and k % 5 == 0:
            content += objects(CAN_STATISTIC, stamp, struct.pack("<HHLLLLLL", 1, 4321, 1, 2, 3, 4, 0, 0)[:28])
            content += objects(APP_TRIGGER, stamp, bytes(range(40)))
            content += objects(ENV_INTEGER, stamp, struct.pack("<LL8x", 4, 4) + b"Gear" + bytes(4), pad=1)
            content += objects(REAL_TIME_CLOCK, stamp, struct.pack("<QQ", stamp, 0))
            content += objects(GLOBAL_MARKER, stamp, b"\0" * 17 + b"LOBJ marker", version=2, pad=4)
    return content + objects(RESTORE_POINTS, 0, bytes(14) + struct.pack("<H", 33) + bytes(range(33)))


@pytest.mark.parametrize("cut", [131_072, 1021])
@pytest.mark.parametrize("other", [False, True])
def test_a_measurement_of_vectors_tools_reads_as_python_can_reads_it(tmp_path, cut, other):
    path = tmp_path / "vector.blf"
    write(path, vector_log(np.random.default_rng(11), 400, other=other), cut=cut)
    reader = read_blf(path)
    frames = concatenate_frames(reader)
    assert reader.notes == []
    assert len(frames) == 400
    with can.BLFReader(path) as peer:
        theirs = from_messages(peer)
    assert np.abs(frames.stamp_ns - theirs.stamp_ns).max() < 1000
    for column in ("ident", "flags", "length", "data", "channel"):
        np.testing.assert_array_equal(getattr(frames, column), getattr(theirs, column), err_msg=column)


def test_error_frames_that_python_can_passes_over_are_kept(tmp_path):
    content = objects(CAN_ERROR, 10, struct.pack("<HH4x", 2, 6))
    content += objects(CAN_MESSAGE, 20, message(0x123, b"12345678"))
    content += objects(CAN_FD_ERROR_64, 30, struct.pack("<BBBBHHHBBL", 3, 0, 0, 5, 0, 0, 0x80, 0, 0, 0x77) + bytes(28))
    path = tmp_path / "errors.blf"
    write(path, content)
    frames = concatenate_frames(read_blf(path))
    assert frames.flags.tolist() == [FrameFlag.ERROR, 0, FrameFlag.ERROR]
    assert frames.channel.tolist() == [1, 1, 2]
    assert frames.length.tolist() == [0, 8, 0]
    assert (frames.stamp_ns - frames.stamp_ns[0]).tolist() == [0, 10, 20]


def small(ident, data, *, announced=None):
    """A CAN_MESSAGE with no more bytes of payload than it has to have."""
    return struct.pack("<HBBL", 2, 0, len(data) if announced is None else announced, ident) + data


def read(path, content, **options):
    write(path, content, **options)
    reader = read_blf(path)
    return concatenate_frames(reader), reader.notes


@pytest.mark.parametrize("many", [False, True])
@pytest.mark.parametrize("kind", [CAN_MESSAGE, CAN_FD, CAN_ERROR_EXT])
def test_a_payload_that_fills_less_than_its_column_is_read_as_python_can_reads_it(tmp_path, kind, many):
    body = {CAN_MESSAGE: small(0x124, b"1234"), CAN_FD: fd(0x124, b"12345678")[:28], CAN_ERROR_EXT: error_ext(4, b"12")}
    short = body[kind][:30] if kind == CAN_ERROR_EXT else body[kind]
    content = objects(kind, 10, short) * 3 if many else objects(kind, 10, short)
    content += b"" if many else objects(CAN_MESSAGE, 20, message(0x125, b"12345678"))
    content += objects(APP_TEXT, 0, bytes(80))  # python-can reads no frame so near to the end of a container
    frames, notes = read(tmp_path / "short.blf", content)
    assert notes == []
    with can.BLFReader(tmp_path / "short.blf") as peer:
        theirs = from_messages(peer)
    assert len(frames) == len(theirs) == (3 if many else 2)
    for column in ("ident", "flags", "length", "data", "channel"):
        np.testing.assert_array_equal(getattr(frames, column), getattr(theirs, column), err_msg=column)


SHORT_OF_PAYLOAD = [
    (CAN_MESSAGE, small(0x124, b"1234", announced=8)),
    (CAN_MESSAGE2, small(0x124, b"", announced=1)),
    (CAN_FD, fd(0x124, b"1" * 64)[:40]),
    (CAN_FD, struct.pack("<HBBLLBBB5x64s", 1, 0, 15, 0x124, 0, 0, 1, 65, b"1" * 64)),
    (CAN_FD_64, struct.pack("<BBBBLLL16xHBBL", 3, 15, 65, 0, 0x124, 0, 0x1000, 0, 0, 0, 0) + b"1" * 65),
    (CAN_ERROR_EXT, error_ext(4, b"12345678")[:30]),
]


@pytest.mark.parametrize(("kind", "body"), SHORT_OF_PAYLOAD)
@pytest.mark.parametrize("version", [1, 2])
def test_a_payload_shorter_than_announced_is_left_out_and_counted(tmp_path, kind, body, version):
    good = objects(CAN_MESSAGE, 20, message(0x125, b"12345678"))
    bad = objects(kind, 10, body, version=version)
    frames, notes = read(tmp_path / "short.blf", good + bad + good + bad)
    assert frames.ident.tolist() == [0x125] * 2
    assert frames.data[:, 0].tolist() == [ord("1")] * 2
    what = "2 frames were left out: they announce more payload than their objects have"
    assert notes == [f"{tmp_path / 'short.blf'}: after frame 0: {what}"]
    frames, notes = read(tmp_path / "alone.blf", bad * 3)
    assert len(frames) == 0
    assert "3 frames were left out" in notes[0]


def test_a_payload_that_the_tool_cut_off_is_read_as_vectors_tools_read_it_and_said(tmp_path):
    """CANoe shows zeros for them (python-can's issue 1905)."""
    content = objects(CAN_MESSAGE, 20, message(0x125, b"12345678"))
    content += objects(CAN_FD_64, 10, fd_64(0x124, b"1" * 64)[: 40 + 48])
    frames, notes = read(tmp_path / "cut.blf", content)
    assert frames.length.tolist() == [8, 64]
    assert bytes(frames.data[1]) == b"1" * 48 + bytes(16)
    assert len(notes) == 1
    assert "1 CAN FD frames announce more payload than their objects have; zeros stand for the rest" in notes[0]


def test_a_payload_never_reaches_into_the_next_object(tmp_path):
    body = bytearray(fd_64(0x124, b"1" * 64)[: 40 + 48])
    body[35] = 255  # where the appended block starts: behind the object
    content = objects(CAN_FD_64, 10, bytes(body)) + objects(CAN_MESSAGE, 20, message(0x125, b"12345678"))
    frames, notes = read(tmp_path / "offset.blf", content)
    assert bytes(frames.data[0]) == b"1" * 48 + bytes(16)
    assert "zeros stand for the rest" in notes[0]


def version_3(content):
    return content.replace(b"LOBJ\x20\x00\x01\x00", b"LOBJ\x20\x00\x03\x00")


UNDECODED = [
    version_3(objects(CAN_MESSAGE, 10, message(0x124, b"12345678"))),
    version_3(objects(CAN_FD_64, 10, fd_64(0x124, b"12345678"))),
    version_3(objects(CAN_ERROR, 10, struct.pack("<HH4x", 2, 6))),
    objects(CAN_FD_64, 10, fd_64(0x124, b"12345678")[:36]),
    objects(CAN_MESSAGE, 10, small(0x124, b"")[:4]),
    objects(CAN_ERROR, 10, b""),
]


@pytest.mark.parametrize("bad", UNDECODED)
def test_frames_in_objects_that_cannot_be_decoded_are_counted(tmp_path, bad):
    good = objects(CAN_MESSAGE, 20, message(0x125, b"12345678")) + objects(APP_TEXT, 0, bytes(20))
    frames, notes = read(tmp_path / "odd.blf", good + bad + good + bad)
    assert frames.ident.tolist() == [0x125] * 2
    assert len(notes) == 1
    assert notes[0].startswith(f"{tmp_path / 'odd.blf'}: after frame 0: 2 frames were left out: their objects are too")
    frames, notes = read(tmp_path / "alone.blf", bad * 3)
    assert len(frames) == 0
    assert "3 frames were left out" in notes[0]


def test_objects_of_other_kinds_are_no_frames_in_any_version_of_the_header(tmp_path):
    content = version_3(objects(APP_TEXT, 0, bytes(20)))
    frames, notes = read(tmp_path / "text.blf", content * 3)
    assert len(frames) == 0
    assert notes == []


def test_a_frame_outside_of_a_container_is_said(tmp_path):
    path = tmp_path / "outside.blf"
    write(path, objects(CAN_MESSAGE, 20, message(0x125, b"12345678")))
    size = path.stat().st_size
    path.write_bytes(path.read_bytes() + objects(CAN_MESSAGE, 30, message(0x126, b"12345678")))
    reader = read_blf(path)
    assert concatenate_frames(reader).ident.tolist() == [0x125]
    assert reader.notes == [f"{path}: after frame 0 at byte {size}: a frame outside of a container was left out"]


@pytest.mark.parametrize("cut", [16, 20, 31])
def test_a_file_that_ends_in_the_header_of_a_container_is_known_to_be_cut(tmp_path, cut):
    path = tmp_path / "cut.blf"
    write(path, objects(CAN_MESSAGE, 20, message(0x125, b"12345678")))
    path.write_bytes(path.read_bytes()[: 144 + cut])
    reader = read_blf(path)
    assert len(concatenate_frames(reader)) == 0
    assert "the last container is cut off" in reader.notes[0]
