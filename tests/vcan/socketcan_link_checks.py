"""What `SocketCanLink` promises, on a real vcan0; run by `test_vcan_machine.py` where that interface is up."""

from __future__ import annotations

import subprocess
import time

import numpy as np
import pytest

from etb_hil.base.clock import WallClock
from etb_hil.base.errors import BenchFault
from etb_hil.canio.frames import FrameBlock, FrameFlag, concatenate_frames
from etb_hil.canio.link import BusSettings, open_link

CLASSIC = BusSettings(interface="socketcan", channel="vcan0")
FD = BusSettings(interface="socketcan", channel="vcan0", fd=True)


def ip(*words):
    subprocess.run(["ip", "link", *words], check=True)


def frames(count, settings):
    width, flag = (64, FrameFlag.FD | FrameFlag.BITRATE_SWITCH) if settings.fd else (8, 0)
    numbers = np.arange(count, dtype=np.uint32)
    return FrameBlock(
        np.zeros(count, np.int64),
        0x100 + numbers % 16,
        np.full(count, flag, np.uint8),
        np.full(count, width, np.uint8),
        (numbers[:, None] + np.arange(width)).astype(np.uint8),
        np.zeros(count, np.uint8),
    )


def collect(link, count):
    parts, deadline = [], time.monotonic() + 10
    while sum(map(len, parts)) < count and time.monotonic() < deadline:
        parts.append(link.receive())
    return concatenate_frames(parts)


@pytest.fixture(params=[CLASSIC, FD], ids=["classic", "fd"])
def settings(request):
    return request.param


@pytest.fixture
def ends(settings):
    links = [open_link(settings, WallClock()) for _ in range(2)]
    yield links
    for link in links:
        link.close()


def test_frames_arrive_in_order_with_stamps_and_own_ones_are_marked(ends, settings):
    here, there = ends
    sent = frames(3000, settings)  # ten times what a socket of the default size holds unread
    start_ns = time.time_ns()
    here.send(sent)
    end_ns = time.time_ns()
    for link, mark in ((there, 0), (here, FrameFlag.SENT)):
        got = collect(link, 3000)
        np.testing.assert_array_equal(got.ident, sent.ident)
        np.testing.assert_array_equal(got.length, sent.length)
        np.testing.assert_array_equal(got.data, sent.data)
        np.testing.assert_array_equal(got.flags, sent.flags | mark)
        assert np.all(np.diff(got.stamp_ns) >= 0)
        assert start_ns <= got.stamp_ns[0] <= got.stamp_ns[-1] <= end_ns
    health = there.health(), here.health()
    assert [(h.sent, h.received, h.error_frames, h.dropped) for h in health] == [(0, 3000, 0, 0), (3000, 0, 0, 0)]


def test_an_interface_that_goes_down_is_a_bench_fault_and_comes_back(ends, settings):
    here, there = ends
    ip("set", "vcan0", "down")
    try:
        with pytest.raises(BenchFault, match="Network is down; bring it up: ip link set vcan0 up"):
            here.send(frames(1, settings))
    finally:
        ip("set", "vcan0", "up")
    with pytest.raises(BenchFault, match="Network is down"):
        there.receive()  # the kernel reports an outage once to each socket, even after it
    here.send(frames(1, settings))
    assert len(collect(there, 1)) == 1


def test_an_interface_that_is_deleted_is_a_bench_fault(ends, settings):
    here, there = ends
    ip("del", "vcan0")
    try:
        with pytest.raises(BenchFault, match="plug the adapter in"):
            here.send(frames(1, settings))
        with pytest.raises(BenchFault, match="cannot be read"):
            there.receive()
        with pytest.raises(BenchFault, match="plug the adapter in"):
            open_link(settings, WallClock())
    finally:
        ip("add", "dev", "vcan0", "type", "vcan")
        ip("set", "vcan0", "mtu", "72", "up")


def test_a_classic_interface_refuses_fd_frames_and_says_what_to_do():
    ip("set", "vcan0", "down")
    ip("set", "vcan0", "mtu", "16", "up")
    link = open_link(FD, WallClock())
    try:
        with pytest.raises(BenchFault, match="ip link set vcan0 mtu 72"):
            link.send(frames(1, FD))
    finally:
        link.close()
        ip("set", "vcan0", "down")
        ip("set", "vcan0", "mtu", "72", "up")
