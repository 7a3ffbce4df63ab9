"""A small file costs little, whatever it claims: no block counts twice, and no claim is believed."""

import sqlite3
import struct
import time
import zlib

import numpy as np
import pytest
from test_logs import read

from etb_hil.base.errors import InputError
from etb_hil.canio.frames import FrameBlock, FrameFlag
from etb_hil.canio.logs.writing import write_log

START_NS = 1_700_000_000_000_000_000
SOON_S = 60.0  # of the processor: a reader that hangs takes longer


def frames(count, channel=0):
    zero = np.zeros(count, np.uint8)
    return FrameBlock(
        START_NS + np.arange(count) * 1_000_000, np.full(count, 0x123, np.uint32), zero, zero + 8,
        np.zeros((count, 8), np.uint8), zero + channel,
    )  # fmt: skip


def written(path, block):
    log = write_log(path, START_NS)
    log.write(block)
    log.close()
    return bytearray(path.read_bytes())


def soon(path):
    begin = time.process_time()
    try:
        got, notes = read(path)
    except InputError as error:
        got, notes = [], [str(error)]
    assert time.process_time() - begin < SOON_S
    assert len(notes) < 20
    assert sum(map(len, notes)) < 5000
    return got, notes


def test_an_mf4_file_that_lists_one_block_many_times_is_damaged(tmp_path):
    path = tmp_path / "loop.mf4"
    data = written(path, frames(20_000))
    at = data.index(b"##DL")
    links = struct.unpack_from("<Q", data, at + 16)[0]
    first = struct.unpack_from("<Q", data, at + 32)[0]
    struct.pack_into(f"<{links - 1}Q", data, at + 32, *[first] * (links - 1))
    struct.pack_into("<Q", data, at + 24, at)  # and goes on with itself
    group = data.index(b"##CG")
    count = struct.unpack_from("<Q", data, group + 16)[0]
    struct.pack_into("<Q", data, group + 24 + 8 * count + 8, 1 << 60)
    path.write_bytes(data)
    got, notes = soon(path)
    assert len(got) == 8192
    assert "its blocks go in circles" in notes[0]


def test_mf4_groups_in_circles_are_damaged(tmp_path):
    path = tmp_path / "groups.mf4"
    data = written(path, frames(100))
    at = data.index(b"##DG")
    struct.pack_into("<Q", data, at + 24, at)
    path.write_bytes(data)
    assert "its blocks go in circles" in soon(path)[1][0]


def test_mf4_groups_that_all_unpack_to_much_are_not_held_at_once(tmp_path):
    path = tmp_path / "many.mf4"
    block = frames(100)
    block.flags[::2] = FrameFlag.ERROR
    block.flags[1::4] = FrameFlag.REMOTE
    data = written(path, block)
    for _ in range(3):
        at = data.index(b"##DZ")
        packed = zlib.compress(bytes(60 << 20), 9)
        head = bytes(data[at + 24 : at + 32]) + struct.pack("<QQ", 60 << 20, len(packed))
        new = b"##DZ" + bytes(4) + struct.pack("<QQ", 48 + len(packed), 0) + head + packed
        data[at : at + 4] = b"##xx"
        place = len(data)
        data += new + bytes(-len(new) % 8)
        for link in range(24, place - 8, 8):
            if struct.unpack_from("<Q", data, link)[0] == at:
                struct.pack_into("<Q", data, link, place)
    path.write_bytes(data)
    assert "at once" in "".join(soon(path)[1])


@pytest.mark.parametrize("size", [1 << 20, 0xFFFFFFFF])
def test_a_blf_object_that_claims_to_be_long_does_not_gather_the_rest(tmp_path, size):
    path = tmp_path / "claim.blf"
    head = bytes(written(path, frames(10))[:144])
    objects = b"LOBJ" + struct.pack("<HHII", 32, 1, size, 86) + bytes(16)
    packed = zlib.compress(objects * 200 + bytes(32 << 20), 9)
    container = b"LOBJ" + struct.pack("<HHIIH6xI4x", 16, 1, 32 + len(packed), 10, 2, len(objects) * 200 + (32 << 20))
    path.write_bytes(head + (container + packed + bytes(len(packed) % 4)) * 20)
    got, notes = soon(path)
    assert len(got) == 0
    assert notes


def test_blf_frames_on_channels_beyond_255_are_left_out_and_counted(tmp_path):
    path = tmp_path / "far.blf"
    data = written(path, frames(10, 7))
    body = bytearray(zlib.decompress(data[144 + 32 :]))
    for row in range(3):
        struct.pack_into("<H", body, 48 * row + 32, 256 + row)
    packed = zlib.compress(bytes(body))
    struct.pack_into("<I", data, 144 + 8, 32 + len(packed))
    path.write_bytes(data[: 144 + 32] + packed)
    got, notes = read(path)
    assert got.channel.tolist() == [255] + [7] * 7
    assert "2 frames on channels above 255 were left out" in notes[0]


@pytest.mark.parametrize(("unit", "stamp"), [(1, 2**63 // 10_000), (1, 2**64 - 1), (2, 2**63), (2, 2**64 - 1)])
def test_blf_frames_with_stamps_beyond_64_bits_are_left_out_and_counted(tmp_path, unit, stamp):
    path = tmp_path / "late.blf"
    data = written(path, frames(10))
    body = bytearray(zlib.decompress(data[144 + 32 :]))
    struct.pack_into("<I", body, 48 * 4 + 16, unit)
    struct.pack_into("<Q", body, 48 * 4 + 24, stamp)
    packed = zlib.compress(bytes(body))
    struct.pack_into("<I", data, 144 + 8, 32 + len(packed))
    path.write_bytes(data[: 144 + 32] + packed)
    got, notes = read(path)
    assert got.stamp_ns.tolist() == [START_NS + 1_000_000 * k for k in range(10) if k != 4]
    assert "1 frames stamped after the year 2255 were left out" in "".join(notes)


def test_an_sqlite_view_that_never_ends_is_refused(tmp_path):
    path = tmp_path / "view.db"
    with sqlite3.connect(path) as database:
        row = "0.0 AS ts, n AS arbitration_id, 0 AS extended, 0 AS remote, 0 AS error, 0 AS dlc, x'' AS data"
        count = "WITH RECURSIVE c(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM c)"
        database.execute(f"CREATE VIEW messages AS {count} SELECT {row} FROM c")  # noqa: S608 (the view is the test)
    assert "is a view, no table" in soon(path)[1][0]


def test_an_sqlite_payload_that_is_a_number_is_refused(tmp_path):
    path = tmp_path / "number.db"
    written(path, frames(2))
    with sqlite3.connect(path) as database:
        database.execute("UPDATE messages SET data = 4000000000 WHERE rowid = 2")
    got, notes = soon(path)
    assert len(got) == 1
    assert "a payload must be a BLOB" in notes[0]


def test_an_mf4_channel_without_a_name_is_not_that_of_time(tmp_path):
    path = tmp_path / "nameless.mf4"
    data = written(path, frames(10))
    at = data.index(b"CAN_DataFrame.BRS\0")
    data[at] = 0
    path.write_bytes(data)
    got, notes = read(path)
    assert notes == []
    assert got.stamp_ns.tolist() == frames(10).stamp_ns.tolist()
