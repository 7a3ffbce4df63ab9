"""MF4 bus logs give the frames that python-can reads through asammdf; broken ones give what came before."""

import gc

import asammdf
import can
import cantools
import numpy as np
import pytest
from can.io.mf4 import MF4Reader, MF4Writer
from hypothesis import HealthCheck, given, settings
from test_logs import messages, same

from etb_hil.base.errors import InputError
from etb_hil.canio.dbc.columns import ColumnDecoder
from etb_hil.canio.frames import FrameBlock, FrameFlag, concatenate_frames
from etb_hil.canio.logs.reading import read_log
from etb_hil.canio.logs.writing import write_log
from etb_hil.canio.messages import from_messages

pytestmark = pytest.mark.filterwarnings(
    "ignore::DeprecationWarning",
    "ignore::ResourceWarning",
    "ignore::pytest.PytestUnraisableExceptionWarning",  # asammdf closes no file that it refuses
)


@pytest.fixture(autouse=True)
def _nothing_is_left_behind():
    """What asammdf leaves open is found here, not in a later test."""
    yield
    gc.collect()


def read(path):
    log = read_log(path)
    return concatenate_frames(log), log.notes


def write(path, frames, level=2):
    writer = MF4Writer(path, compression_level=level)
    writer._start_time = 0.0  # else stamps before now would be negative
    for message in frames:
        writer.on_message_received(message)
    writer.stop()


def kinds(frames):
    """Some frames of every kind that an MF4 file has groups for."""
    changed = []
    for number, message in enumerate(frames):
        if number % 3 == 1 and not message.is_fd:
            changed.append(can.Message(timestamp=message.timestamp, is_error_frame=True, is_extended_id=False))
        if number % 3 == 2 and not message.is_fd:
            changed.append(can.Message(timestamp=message.timestamp, arbitration_id=5, is_remote_frame=True, dlc=3))
        changed.append(message)
    return changed


@pytest.mark.parametrize("level", [0, 1, 2])
@given(frames=messages())
@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_what_python_can_writes_is_read_as_it_reads_it(tmp_path_factory, level, frames):
    path = tmp_path_factory.mktemp("log") / "frames.mf4"
    frames = kinds(frames)
    write(path, frames, level)
    with MF4Reader(path) as reader:
        peer = from_messages(list(reader))
    got, notes = read(path)
    assert notes == []
    same(got, peer)
    np.testing.assert_array_equal(got.channel, peer.channel)
    assert np.max(np.abs(got.stamp_ns - peer.stamp_ns)) < 500
    expected = np.sort([round(message.timestamp * 1e9) for message in frames])
    steps = np.diff(got.stamp_ns) - np.diff(expected)
    assert np.max(np.abs(steps), initial=0) < 1000


def many(count):
    return [
        can.Message(timestamp=k * 0.001, arbitration_id=k % 2048, is_extended_id=False, data=bytes([k % 256] * (k % 9)))
        for k in range(count)
    ]


@pytest.mark.parametrize("level", [0, 1, 2])
def test_a_cut_file_is_never_a_traceback(tmp_path, level):
    path = tmp_path / "cut.mf4"
    write(path, many(300), level)
    content, whole = path.read_bytes(), read(path)[0]
    rng = np.random.default_rng(3)
    for size in rng.integers(0, len(content), 25):
        path.write_bytes(content[:size])
        try:
            got, notes = read(path)
        except InputError as error:
            assert str(error).startswith(str(path))  # noqa: PT017
        else:
            same(got, whole, slice(len(got)))
            assert len(got) == len(whole) or notes


def test_a_damaged_file_is_never_a_traceback(tmp_path):
    path = tmp_path / "damaged.mf4"
    write(path, many(40), 2)
    content = path.read_bytes()
    rng = np.random.default_rng(4)
    for _ in range(60):
        broken = bytearray(content)
        for at in rng.integers(0, len(content), 4):
            broken[at] = rng.integers(0, 256)
        path.write_bytes(broken)
        try:
            got, _ = read(path)
        except InputError as error:
            assert str(path) in str(error)  # noqa: PT017
        else:
            assert len(got) <= 10_000


def test_frames_written_by_us_are_read_by_python_can(tmp_path):
    frames = from_messages(kinds(many(50)))
    frames.flags[::2] |= np.uint8(FrameFlag.SENT)
    path = tmp_path / "ours.mf4"
    log = write_log(path, 0)
    log.write(frames.select(slice(30)))
    log.write(frames.select(slice(30, None)))
    log.close()
    with MF4Reader(path) as reader:
        peer = from_messages(list(reader))
    got, notes = read(path)
    assert notes == []
    same(got, peer)
    np.testing.assert_array_equal(np.sort(got.stamp_ns), np.sort(frames.stamp_ns))
    assert np.count_nonzero(got.flags & FrameFlag.SENT) == np.count_nonzero(frames.flags & FrameFlag.SENT)


def test_asammdf_decodes_what_we_write_as_we_decode_it(tmp_path):
    text = 'VERSION ""\nBU_: A\nBO_ 100 M: 8 A\n'
    text += ' SG_ S : 3|13@1- (0.25,-3) [0|0] "A" A\n SG_ T : 23|16@0+ (2,1) [0|0] "" A\n'
    dbc = tmp_path / "m.dbc"
    dbc.write_text(text)
    rng = np.random.default_rng(5)
    count = 20_000  # more than are packed together
    frames = FrameBlock(
        1_763_600_000_250_000_000 + np.arange(count) * 1_000_001,
        np.full(count, 100, np.uint32),
        np.zeros(count, np.uint8),
        np.full(count, 8, np.uint8),
        rng.integers(0, 256, (count, 8), dtype=np.uint8),
        np.zeros(count, np.uint8),
    )
    path = tmp_path / "ours.mf4"
    log = write_log(path, int(frames.stamp_ns[0]))
    log.write(frames.select(slice(5000)))
    log.write(frames.select(slice(5000, None)))
    log.close()
    (ours,) = ColumnDecoder(cantools.database.load_file(dbc).messages).push(frames)
    with asammdf.MDF(path) as mdf:
        assert mdf.start_time.timestamp() == 1_763_600_000
        decoded = mdf.extract_bus_logging({"CAN": [(str(dbc), 0)]})
        for name, values in ours.columns.items():
            signal = decoded.get(name)
            np.testing.assert_array_equal(signal.samples.astype(float), values)
            np.testing.assert_allclose(signal.timestamps, (frames.stamp_ns - 1_763_600_000 * 10**9) * 1e-9, atol=1e-9)
    np.testing.assert_array_equal(read(path)[0].stamp_ns, frames.stamp_ns)


@pytest.mark.parametrize(("compression", "mixed"), [(3, True), (4, False), (5, False), (6, True)])
def test_blocks_packed_in_other_ways_are_read_as_python_can_reads_them(tmp_path, compression, mixed):
    """Zstandard and LZ4, plain and transposed, of MDF 4.3."""
    plain, path = tmp_path / "plain.mf4", tmp_path / "packed.mf4"
    write(plain, kinds(many(30)) if mixed else many(30), 0)
    with asammdf.MDF(plain) as mdf, mdf.convert("4.30") as newer:
        newer.save(path, compression=compression, overwrite=True)
    with MF4Reader(path) as reader:
        peer = from_messages(list(reader))
    got, notes = read(path)
    assert notes == []
    assert len(got) == (50 if mixed else 30)
    same(got, peer)


def test_records_in_a_list_of_columns_are_read_by_asammdf(tmp_path, monkeypatch):
    """Our reader knows no such list, and hands the file over before it has given a frame."""
    asked = []
    monkeypatch.setattr("etb_hil.canio.logs.mf4.frames_by_asammdf", lambda path, _: asked.append(path) or iter(()))
    path = tmp_path / "columns.mf4"
    write(path, kinds(many(30)), 2)
    data = path.read_bytes()
    kind = b"##DL" if b"##DL" in data else b"##DZ"
    path.write_bytes(data.replace(kind, b"##LD"))
    assert len(read(path)[0]) == 0
    assert asked == [path]


@pytest.mark.parametrize(("kind", "method"), [(b"##xx", 0), (b"##DZ", 9)])
def test_a_damaged_kind_of_block_costs_its_group_alone(tmp_path, kind, method):
    path = tmp_path / "damaged.mf4"
    log = write_log(path, 0)
    log.write(from_messages(kinds(many(30))))
    log.close()
    data = bytearray(path.read_bytes())
    at = data.rindex(b"##DZ")
    data[at : at + 4] = kind
    data[at + 26] = method
    path.write_bytes(data)
    got, notes = read(path)
    assert 0 < len(got) < 50
    assert "nothing behind it was read" in notes[0]


def test_a_block_beyond_the_bound_is_refused_however_it_is_packed(tmp_path):
    path = tmp_path / "large.mf4"
    log = write_log(path, 0)
    log.write(from_messages(many(30)))
    log.close()
    data = bytearray(path.read_bytes())
    at = data.index(b"##DZ")
    data[at + 26] = 2
    data[at + 32 : at + 40] = (65 << 20).to_bytes(8, "little")
    path.write_bytes(data)
    got, notes = read(path)
    assert len(got) == 0
    assert f"a block of {65 << 20} bytes is packed by method 2; nothing behind it was read" in notes[0]
