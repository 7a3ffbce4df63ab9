"""What every format of log promises: frames of all kinds and channels come back, and a cut file gives its beginning."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

from etb_hil.base.errors import InputError
from etb_hil.canio.frames import FrameBlock, FrameFlag, concatenate_frames
from etb_hil.canio.logs.reading import read_log
from etb_hil.canio.logs.writing import write_log

START_NS = 1_763_600_000_250_000_000
EXTENDED, REMOTE, ERROR = FrameFlag.EXTENDED, FrameFlag.REMOTE, FrameFlag.ERROR
FD = FrameFlag.FD | FrameFlag.BITRATE_SWITCH
# What a format holds beside data frames: FD frames, channels, error frames and their mark of 29 bits, remote frames.
TEXT = [".asc", ".log", ".trc", ".csv"]
ALL = [".blf", ".mf4", ".db", *TEXT, *(f"{suffix}.gz" for suffix in TEXT)]
ONE_CHANNEL = {".csv", ".db"}
WITHOUT_FD = {".csv", ".db", ".trc"}
DATA_ALONE = {".trc"}
WITHOUT_REMOTE_LENGTH = {".log"}


def traffic(fd):
    """Frames of every kind on three channels, a millisecond apart."""
    kinds = [
        (0x123, 0, bytes(range(8))), (0x18FEF100, EXTENDED, b"\xa5\x5a"), (0x7FF, 0, b""), (0x100, REMOTE, b"12345"),
        (0x0, ERROR | EXTENDED, b""), (0x321, 0, b"LOBJ\n,#"), (0x1FFFFFFF, EXTENDED | REMOTE, b""),
    ]  # fmt: skip
    kinds += [(0x200, FD, bytes(range(64))), (0x201, FD, b"123456789012"), (0x202, FrameFlag.FD, b"1")] if fd else []
    rows = kinds * 40
    count = len(rows)
    data = np.zeros((count, 64 if fd else 8), np.uint8)
    for row, (_, flags, payload) in enumerate(rows):
        if not flags & REMOTE:
            data[row, : len(payload)] = np.frombuffer(payload, np.uint8)
    return FrameBlock(
        START_NS + np.arange(count) * 1_000_000,
        np.array([ident for ident, _, _ in rows], np.uint32),
        np.array([int(flags) for _, flags, _ in rows], np.uint8),
        np.array([len(payload) for _, _, payload in rows], np.uint8),
        data,
        (np.arange(count) % 3).astype(np.uint8),
    )


def write(path, frames):
    log = write_log(path, int(frames.stamp_ns[0]))
    log.write(frames.select(slice(100)))
    log.write(frames.select(slice(100, None)))
    log.close()
    return log.left_out


def held(suffix, frames):
    """The frames that a format holds."""
    keep = np.ones(len(frames), np.bool_)
    if suffix in WITHOUT_FD:
        keep &= (frames.flags & FrameFlag.FD) == 0
    if suffix in DATA_ALONE:
        keep &= (frames.flags & (ERROR | REMOTE)) == 0
    kept = frames.select(keep)
    if suffix in WITHOUT_REMOTE_LENGTH:
        kept.length[(kept.flags & REMOTE) != 0] = 0
    return kept


def read(path):
    log = read_log(path)
    return concatenate_frames(log), log.notes


def assert_same(got, expected, suffix):
    suffix = suffix.removesuffix(".gz")
    error = (expected.flags & ERROR) != 0
    np.testing.assert_array_equal(got.flags & ~np.uint8(EXTENDED), expected.flags & ~np.uint8(EXTENDED))
    np.testing.assert_array_equal(got.flags[~error], expected.flags[~error])
    for column in ("ident", "length"):
        np.testing.assert_array_equal(getattr(got, column)[~error], getattr(expected, column)[~error], err_msg=column)
    width = min(got.data.shape[1], expected.data.shape[1])
    np.testing.assert_array_equal(got.data[~error, :width], expected.data[~error, :width])
    assert not got.data[:, width:].any()
    channels = np.zeros(len(expected), int) if suffix in ONE_CHANNEL else expected.channel
    alike = ~error if suffix == ".log" else slice(None)  # candump's error frames are read without their channel
    np.testing.assert_array_equal(got.channel[alike], channels[alike])
    after, before = got.stamp_ns - got.stamp_ns[0], expected.stamp_ns - expected.stamp_ns[0]
    assert np.abs(after - before).max(initial=0) <= 1000


@pytest.mark.parametrize("suffix", ALL)
@pytest.mark.parametrize("fd", [False, True])
def test_frames_of_every_kind_come_back(tmp_path, suffix, fd):
    frames = traffic(fd)
    path = tmp_path / f"log{suffix}"
    left_out = write(path, frames)
    expected = held(suffix.removesuffix(".gz"), frames)
    assert left_out == len(frames) - len(expected)
    got, notes = read(path)
    assert notes == []
    assert len(got) == len(expected)
    assert_same(got, expected, suffix)


@pytest.mark.parametrize("suffix", [".blf", ".mf4", ".db"])
def test_what_is_no_text_is_unpacked_to_be_read(tmp_path, suffix):
    frames = traffic(suffix != ".db")
    path, packed = tmp_path / f"log{suffix}", tmp_path / f"packed{suffix}.gz"
    write(path, frames)
    packed.write_bytes(gzip.compress(path.read_bytes()))
    expected, got = read(path), read(packed)
    assert got[1] == []
    for column in ("stamp_ns", "ident", "flags", "length", "data", "channel"):
        np.testing.assert_array_equal(getattr(got[0], column), getattr(expected[0], column))
    packed.write_bytes(packed.read_bytes()[:-40])
    if suffix == ".db":  # of which nothing is left
        with pytest.raises(InputError, match=r"(?s)db\.gz: the file is damaged.*db\.gz: frame 0: is not readable"):
            read(packed)
    else:
        got, notes = read(packed)
        assert "the file is damaged" in notes[0]
        assert len(got) > 0
    with pytest.raises(InputError, match="no such file or folder"):
        next(iter(read_log(tmp_path / f"none{suffix}.gz")))


@pytest.mark.parametrize("suffix", [".asc.gz", ".trc.gz"])
def test_of_a_cut_file_in_gzip_almost_all_is_read(tmp_path, suffix):
    frames = traffic(fd=False)
    path = tmp_path / f"log{suffix}"
    write(path, frames)
    path.write_bytes(path.read_bytes()[:-12])  # its checksum, and a few bytes more
    got, notes = read(path)
    assert len(got) > 0.9 * len(held(suffix.removesuffix(".gz"), frames))
    assert "it is cut off" in notes[-1]


@pytest.mark.parametrize("suffix", ALL)
def test_a_cut_file_gives_its_beginning_and_says_so(tmp_path, suffix):
    frames = traffic(suffix.removesuffix(".gz") not in WITHOUT_FD)
    path = tmp_path / f"log{suffix}"
    write(path, frames)
    expected, content = held(suffix.removesuffix(".gz"), frames), path.read_bytes()
    rng = np.random.default_rng(9)
    for size in [*rng.integers(0, len(content), 12), len(content) - 1]:
        path.write_bytes(content[:size])
        try:
            got, notes = read(path)
        except InputError as error:
            assert str(path) in str(error)  # noqa: PT017
            continue
        if len(got):
            assert_same(got, expected.select(slice(len(got))), suffix)
        cannot_be_seen = len(got) == len(expected)
        if suffix in TEXT:
            end = content.rfind(b"\n", 0, size) + 1
            path.write_bytes(content[:end])
            cannot_be_seen |= not content[end:size].strip() or len(got) > len(read(path)[0])
        assert notes or cannot_be_seen, size
