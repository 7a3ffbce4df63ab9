"""Debian's can-utils read the logs that we write, and we read theirs."""

from __future__ import annotations

import shutil
import subprocess

import numpy as np
import pytest
import vcan_machine

from etb_hil.canio.frames import FrameBlock, FrameFlag, concatenate_frames
from etb_hil.canio.logs.reading import read_log
from etb_hil.canio.logs.writing import write_log

START_NS = 1_760_000_000_000_000_000
CLASSIC, FD = 150, 50

pytestmark = pytest.mark.skipif(shutil.which("canplayer") is None, reason="no can-utils (Debian package can-utils)")


def traffic(count=CLASSIC, fd=FD):
    """Return frames of every kind: standard and extended ids, all lengths, remote, FD and its bit-rate switch."""
    rng = np.random.default_rng(3)
    n = count + fd
    stamp_ns = START_NS + np.arange(n) * 1_000_000
    flags, length = np.zeros(n, np.uint8), (np.arange(n) % 9).astype(np.uint8)
    flags[1::3] |= int(FrameFlag.EXTENDED)
    flags[5:count:10] |= int(FrameFlag.REMOTE)
    flags[count:] |= int(FrameFlag.FD)
    flags[count::2] |= int(FrameFlag.BITRATE_SWITCH)
    length[count:] = np.resize(
        [8, 12, 64, 20, 1, 48], fd
    )  # python-can takes an FD frame without data in ASC for a remote one
    length[5:count:10] = 0  # python-can's writer of candump logs does not keep a remote frame's length
    ident = np.where(flags & int(FrameFlag.EXTENDED), 0x18DA0000 + np.arange(n), 0x100 + np.arange(n)).astype(np.uint32)
    data = rng.integers(0, 256, (n, 64)).astype(np.uint8)
    data[np.arange(64) >= length[:, None]] = 0
    data[flags & int(FrameFlag.REMOTE) != 0] = 0
    return FrameBlock(stamp_ns, ident, flags, length, data, np.zeros(n, np.uint8))


def written(path, frames):
    log = write_log(path, int(frames.stamp_ns[0]))
    log.write(frames)
    log.close()
    return path


def assert_same(path, frames, *, stamps=True):
    found = concatenate_frames(read_log(path))
    kinds = 0xFF & ~int(FrameFlag.SENT)
    for name in ("ident", "length"):
        np.testing.assert_array_equal(getattr(found, name), getattr(frames, name), err_msg=name)
    np.testing.assert_array_equal(found.flags & kinds, frames.flags & kinds)
    width = found.data.shape[1]
    np.testing.assert_array_equal(found.data, frames.data[:, :width])
    assert not frames.data[:, width:].any()
    if stamps:
        since = found.stamp_ns - found.stamp_ns[0]
        np.testing.assert_allclose(since, frames.stamp_ns - frames.stamp_ns[0], atol=1000)


def test_log2asc_reads_our_candump_and_we_read_its_asc(tmp_path):
    frames = traffic()
    written(tmp_path / "ours.log", frames)
    command = ["log2asc", "-I", tmp_path / "ours.log", "-O", tmp_path / "theirs.asc", "can0"]
    subprocess.run(command, check=True, timeout=60)
    assert_same(tmp_path / "theirs.asc", frames)


def test_asc2log_reads_our_asc_and_we_read_its_candump(tmp_path):
    frames = traffic()
    written(tmp_path / "ours.asc", frames)
    command = ["asc2log", "-I", tmp_path / "ours.asc", "-O", tmp_path / "theirs.log"]
    subprocess.run(command, check=True, timeout=60)
    assert_same(tmp_path / "theirs.log", frames)


def test_canplayer_plays_our_log_and_we_read_what_candump_heard(tmp_path):
    vcan_machine.require()
    frames = traffic()
    folder = tmp_path / "job"
    folder.mkdir()
    written(folder / "ours.log", frames)
    heard = f"candump -L -n {len(frames)} -T 20000 vcan0 > {folder}/theirs.log & sleep 1"
    play = f"canplayer -I {folder}/ours.log vcan0=can0 && wait"
    done = vcan_machine.run(["sh", "-c", f"{heard}; {play}"], folder)
    assert done.returncode == 0, done.stderr
    assert_same(folder / "theirs.log", frames, stamps=False)
