"""The raw log against python-can's writer and reader, and against every way in which a file may end."""

import errno
import os
import re
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import can
import numpy as np
import pytest
from bus_tools import assert_same, block, frames, rows_of
from hypothesis import example, given, settings
from hypothesis import strategies as st

from etb_hil.base.errors import BenchFault, InputError
from etb_hil.canio.frames import FrameBlock, FrameFlag, concatenate_frames
from etb_hil.canio.logs.blf import BlfLog, read_blf
from etb_hil.canio.messages import from_messages, to_message

START = 1_763_600_000_123_456_789
REAL_LOGS = (
    Path(os.environ.get("ETB_HIL_REAL_DATA", Path(__file__).parents[3] / "shared/data")) / "peers/python_can_logs"
)


@st.composite
def logs(draw):
    """Frames as a bus gives them, stamps rising from the start."""
    rows, stamp = [], START
    for ident, flags, payload in draw(st.lists(frames(errors=True), max_size=40)):
        stamp += draw(st.integers(0, 10**10))
        sent = FrameFlag.SENT if draw(st.booleans()) and not flags & FrameFlag.ERROR else FrameFlag(0)
        rows.append((stamp, ident, flags | sent, payload))
    return block(rows, 64 if any(flags & FrameFlag.FD for _, _, flags, _ in rows) else 8)


def written(path, frames, parts=1):
    log = BlfLog(path, START)
    for part in np.array_split(np.arange(len(frames)), parts):
        log.write(frames.select(part))
        log.flush()
    log.close()


def traffic(count, seed=0):
    """Classic frames as on a busy bus."""
    rng = np.random.default_rng(seed)
    length = rng.integers(0, 9, count)
    data = np.where(np.arange(8) < length[:, None], rng.integers(0, 256, (count, 8)), 0)
    return FrameBlock(
        START + np.cumsum(rng.integers(0, 10**6, count)),
        rng.integers(0, 2048, count).astype(np.uint32),
        np.where(rng.random(count) < 0.1, FrameFlag.SENT, 0).astype(np.uint8),
        length.astype(np.uint8),
        data.astype(np.uint8),
        np.zeros(count, np.uint8),
    )


@given(log=logs(), parts=st.integers(1, 3))
def test_what_is_written_is_read_again_to_the_nanosecond(tmp_path_factory, log, parts):
    path = tmp_path_factory.mktemp("blf") / "log.blf"
    written(path, log, parts)
    reader = read_blf(path)
    assert_same(concatenate_frames(reader), log)
    assert reader.notes == []


@given(log=logs())
@settings(max_examples=50)
def test_python_can_reads_what_we_write(tmp_path_factory, log):
    path = tmp_path_factory.mktemp("blf") / "log.blf"
    written(path, log)
    with can.BLFReader(path) as reader:
        theirs = list(reader)
    assert len(theirs) == reader.object_count == len(log)
    assert reader.file_size == path.stat().st_size
    for row, message in enumerate(theirs):
        expected = to_message(log, row)
        assert message.timestamp == pytest.approx(expected.timestamp, abs=1e-6)
        if expected.is_error_frame:
            assert message.is_error_frame
            assert message.arbitration_id == expected.arbitration_id
        else:
            assert message.equals(expected, timestamp_delta=1e-6)


@given(log=logs())
@settings(max_examples=50)
def test_we_read_what_python_can_writes(tmp_path_factory, log):
    path = tmp_path_factory.mktemp("blf") / "log.blf"
    with can.BLFWriter(path) as writer:
        for row in range(len(log)):
            writer.on_message_received(to_message(log, row))
    if not len(log):
        return
    ours = concatenate_frames(read_blf(path))
    assert np.abs(ours.stamp_ns - log.stamp_ns).max() < 1000  # their stamps are floats
    for name in ("ident", "flags", "length", "data", "channel"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(log, name), err_msg=name)


@pytest.mark.parametrize("name", ["CanMessage", "CanMessage2", "CanFdMessage", "CanFdMessage64", "issue_1905"])
def test_files_of_other_tools_read_as_python_can_reads_them(tmp_path, name):
    path = REAL_LOGS / (f"test_{name}.blf" if name.startswith("Can") else f"{name}.blf")
    if not path.exists():
        pytest.skip(f"no {path.name}: set ETB_HIL_REAL_DATA to the folder of real data")
    data = bytearray(path.read_bytes())
    path = tmp_path / path.name
    for found in re.finditer(b"LOBJ", bytes(data)):  # some are on channel 4369, which no column holds
        if int.from_bytes(data[found.start() + 12 : found.start() + 16], "little") in {1, 86, 100}:
            data[found.start() + 33] = 0
    path.write_bytes(data)
    with can.BLFReader(path) as reader:
        theirs = from_messages(reader)
    ours = concatenate_frames(read_blf(path))
    assert len(ours) > 0
    assert np.abs(ours.stamp_ns - theirs.stamp_ns).max() < 1000
    for column in ("ident", "flags", "length", "data", "channel"):
        np.testing.assert_array_equal(getattr(ours, column), getattr(theirs, column), err_msg=column)


def test_many_blocks_come_back_in_bounded_pieces(tmp_path):
    frames = traffic(50_000)
    written(tmp_path / "log.blf", frames, parts=7)
    blocks = list(read_blf(tmp_path / "log.blf"))
    assert max(map(len, blocks)) < 30_000
    assert_same(concatenate_frames(blocks), frames)


def test_a_payload_that_spells_the_signature_does_not_mislead(tmp_path):
    frames = block([(START + i, 0x4A424F4C, FrameFlag.EXTENDED, b"LOBJLOBJ") for i in range(50)])
    frames = concatenate_frames([frames, traffic(10)])
    written(tmp_path / "log.blf", frames)
    reader = read_blf(tmp_path / "log.blf")
    assert rows_of(concatenate_frames(reader)) == [
        (stamp, ident & 0x1FFFFFFF, flags, payload) for stamp, ident, flags, payload in rows_of(frames)
    ]
    assert reader.notes == []


def test_a_file_cut_anywhere_gives_what_stands_before(tmp_path):
    path = tmp_path / "log.blf"
    frames = traffic(3000)
    written(path, frames, parts=10)
    raw = path.read_bytes()
    lengths = []
    for size in range(len(raw), 100, -371):
        path.write_bytes(raw[:size])
        if size < 144:
            continue
        reader = read_blf(path)
        got = concatenate_frames(reader)
        assert_same(got, frames.select(slice(len(got))))
        assert reader.notes or size == len(raw)
        lengths.append(len(got))
    assert lengths == sorted(lengths, reverse=True)
    assert lengths[0] == 3000
    assert lengths[-1] < 300  # the cut reached into the first container


def test_a_file_cut_between_containers_is_known_to_be_cut(tmp_path):
    path = tmp_path / "log.blf"
    frames = traffic(3000)
    written(path, frames, parts=10)
    raw = path.read_bytes()
    edges = [at for at in range(144, len(raw), 4) if raw[at : at + 4] == b"LOBJ"]
    assert len(edges) > 3
    for edge in edges[1:]:
        path.write_bytes(raw[:edge])
        reader = read_blf(path)
        assert 0 < len(concatenate_frames(reader)) < 3000
        assert f"its header says {len(raw)} bytes" in reader.notes[0]


@given(damage=st.lists(st.tuples(st.integers(0, 10**6), st.integers(1, 255)), min_size=1, max_size=8))
@example(damage=[(41, 2)])  # a start in the year 1513
def test_damage_never_ends_in_a_traceback(tmp_path_factory, damage):
    path = tmp_path_factory.mktemp("blf") / "log.blf"
    written(path, traffic(200), parts=3)
    raw = bytearray(path.read_bytes())
    for position, flip in damage:
        raw[position % len(raw)] ^= flip
    path.write_bytes(raw)
    try:
        got = concatenate_frames(read_blf(path))
    except InputError:
        assert raw[:4] != b"LOGG"
    else:
        assert len(got) <= 200


def test_a_damaged_container_costs_itself_only_and_is_noted(tmp_path):
    path = tmp_path / "log.blf"
    frames = traffic(300)
    written(path, frames, parts=3)
    raw = bytearray(path.read_bytes())
    (size,) = struct.unpack_from("<L", raw, 144 + 8)
    raw[144 + size + size % 4 + 60] ^= 0xFF  # inside the second container
    path.write_bytes(raw)
    reader = read_blf(path)
    got = concatenate_frames(reader)
    assert_same(got, concatenate_frames([frames.select(slice(100)), frames.select(slice(200, 300))]))
    (note,) = reader.notes
    assert "a container is damaged" in note


@pytest.mark.parametrize("at", range(40, 400, 30))
def test_damage_never_invents_a_frame(tmp_path, at):
    path = tmp_path / "log.blf"
    frames = traffic(300)
    written(path, frames, parts=3)
    raw = bytearray(path.read_bytes())
    (size,) = struct.unpack_from("<L", raw, 144 + 8)
    first = 144 + size + size % 4 + at  # inside the second container
    raw[first : first + 50] = bytes(50)
    path.write_bytes(raw)
    reader = read_blf(path)
    got = set(rows_of(concatenate_frames(reader)))
    assert got <= set(rows_of(frames))
    assert len(got) >= 200
    assert reader.notes


def test_an_object_over_a_damaged_container_is_not_patched_up_from_its_halves(tmp_path):
    path = tmp_path / "log.blf"
    frames = traffic(300)
    with can.BLFWriter(path, max_container_size=1010) as writer:  # 48 bytes a frame: every container cuts two
        for row in range(len(frames)):
            writer.on_message_received(to_message(frames, row))
    raw = bytearray(path.read_bytes())
    position, originals = 144, {row[1:] for row in rows_of(frames)}
    for _ in range(5):
        (size,) = struct.unpack_from("<L", raw, position + 8)
        position += size + size % 4
    raw[position + 60] ^= 0xFF
    path.write_bytes(raw)
    reader = read_blf(path)
    got = concatenate_frames(reader)
    assert len(got) == 300 - 22
    assert {row[1:] for row in rows_of(got)} <= originals
    assert len(reader.notes) == 2  # the container, and the half object behind it


def test_a_container_that_inflates_without_end_is_held_to_its_word(tmp_path):
    path = tmp_path / "log.blf"
    written(path, traffic(1))
    bomb = zlib.compress(bytes(50 << 20))
    size = 32 + len(bomb)
    head = struct.pack("<4sHHLLH6xL4x", b"LOBJ", 16, 1, size, 10, 2, 64)
    path.write_bytes(path.read_bytes() + head + bomb + bytes(size % 4))
    reader = read_blf(path)
    assert len(concatenate_frames(reader)) == 1


@pytest.mark.parametrize("content", [b"", b"LOGG", b"PK\x03\x04" + bytes(200)])
def test_what_is_no_blf_file_is_refused(tmp_path, content):
    path = tmp_path / "log.blf"
    path.write_bytes(content)
    with pytest.raises(InputError, match="must be a BLF file"):
        list(read_blf(path))


def test_a_missing_file_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match=r"none\.blf: cannot be read"):
        list(read_blf(tmp_path / "none.blf"))


def test_a_killed_process_leaves_all_that_was_flushed(tmp_path):
    path = tmp_path / "log.blf"
    script = f"""
import os, signal, sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
from pathlib import Path
import test_blf
log = test_blf.BlfLog(Path({str(path)!r}), test_blf.START)
frames = test_blf.traffic(5000)
log.write(frames.select(slice(0, 100)))
log.flush()
log.write(frames.select(slice(100, 4321)))
log.flush()
log.write(frames.select(slice(4321, 4400)))
os.kill(os.getpid(), signal.SIGKILL)
"""
    done = subprocess.run([sys.executable, "-c", script], check=False)
    assert done.returncode == -9
    assert_same(concatenate_frames(read_blf(path)), traffic(5000).select(slice(4321)))
    with can.BLFReader(path) as reader:
        theirs = from_messages(reader)
    assert len(theirs) == 4321
    assert np.abs(theirs.stamp_ns - traffic(5000).stamp_ns[:4321]).max() < 1000


def test_a_frame_that_the_driver_held_already_is_kept_and_an_older_one_refused(tmp_path):
    log = BlfLog(tmp_path / "log.blf", START)
    held = block([(START - 10**9, 1, 0, b"")])
    log.write(held)
    with pytest.raises(BenchFault, match="is older than the log"):
        log.write(block([(START - 2 * 10**9, 1, 0, b"")]))
    log.close()
    assert_same(concatenate_frames(read_blf(tmp_path / "log.blf")), held)


def test_a_log_may_start_at_zero(tmp_path):
    log = BlfLog(tmp_path / "log.blf", 0)
    frames = block([(0, 1, 0, b""), (17, 2, 0, b"")])
    log.write(frames)
    log.close()
    assert_same(concatenate_frames(read_blf(tmp_path / "log.blf")), frames)
    with can.BLFReader(tmp_path / "log.blf") as reader:
        assert [message.timestamp for message in reader] == [0.0, 17e-9]


def test_a_full_disk_is_a_bench_fault_and_leaves_whole_containers(tmp_path, monkeypatch):
    path = tmp_path / "log.blf"
    log = BlfLog(path, START)
    frames = traffic(2000)
    log.write(frames.select(slice(0, 1000)))
    log.flush()
    log.write(frames.select(slice(1000, 2000)))
    whole = path.stat().st_size
    file = log._file

    class Full:
        def write(self, data):
            if file.tell() == whole:
                return file.write(data[:100])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        def __getattr__(self, name):
            return getattr(file, name)

    with monkeypatch.context() as patch:
        patch.setattr(log, "_file", Full())
        with pytest.raises(BenchFault, match="No space left on device"):
            log.flush()
    assert path.stat().st_size == whole
    log.close()
    assert_same(concatenate_frames(read_blf(path)), frames.select(slice(0, 1000)))


def test_a_folder_that_is_not_there_is_a_bench_fault(tmp_path):
    with pytest.raises(BenchFault, match="cannot be written"):
        BlfLog(tmp_path / "none" / "log.blf", START)


def test_reading_a_log_imports_neither_python_can_nor_numba(tmp_path):
    written(tmp_path / "log.blf", traffic(10))
    script = (
        "import sys; from pathlib import Path; from etb_hil.canio.logs.blf import read_blf; "
        f"print(sum(map(len, read_blf(Path({str(tmp_path / 'log.blf')!r})))), {{'can', 'numba'}} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert done.stdout == "10 set()\n"
