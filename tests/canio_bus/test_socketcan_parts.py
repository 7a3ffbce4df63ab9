"""What a link over SocketCAN makes of what kernel and driver tell it, without either."""

import errno
import json
import os
import shutil
import socket
import struct
import subprocess
import time

import pytest
from bus_tools import frame, rows_of

from etb_hil.base.clock import WallClock
from etb_hil.base.errors import BenchFault, InputError
from etb_hil.canio.bus import socketcan_link as module
from etb_hil.canio.bus.bus_settings import BusSettings
from etb_hil.canio.bus.health import BusState
from etb_hil.canio.bus.socketcan_link import SocketCanLink
from etb_hil.canio.frames import FrameFlag

if not hasattr(socket, "AF_CAN"):
    pytest.skip("Python without SocketCAN", allow_module_level=True)

STAMP, DROPS = 35, 40  # SO_TIMESTAMPNS, SO_RXQ_OVFL
CONFIRM = socket.MSG_CONFIRM


class Kernel:
    """A raw CAN socket that gives what a test put in."""

    def __init__(self):
        self.waiting, self.sent = [], []
        self.fault = None

    def __call__(self, *_):
        return self

    def setsockopt(self, _level, option, _value):
        if option == 33:
            raise PermissionError  # SO_RCVBUFFORCE is for root

    def bind(self, _address):
        pass

    def close(self):
        pass

    def send(self, data, flags):
        assert flags == socket.MSG_DONTWAIT
        if self.fault:
            raise OSError(self.fault, os.strerror(self.fault))
        self.sent.append(data)
        return len(data)

    def recvmsg(self, *_):
        if self.fault:
            raise OSError(self.fault, os.strerror(self.fault))
        if not self.waiting:
            raise BlockingIOError
        return self.waiting.pop(0)

    def arrives(self, ident, payload, *, fd=False, bits=0, stamp=(1, 0), flags=0, drops=None):
        raw = struct.pack("<IBBxx", ident, len(payload), bits) + payload.ljust(64 if fd else 8, b"\0")
        ancillary = [(socket.SOL_SOCKET, STAMP, struct.pack("@qq", *stamp))]
        if drops is not None:
            ancillary.append((socket.SOL_SOCKET, DROPS, struct.pack("@I", drops)))
        self.waiting.append((raw, ancillary, flags, None))


def told(monkeypatch, **data):
    """Let `ip` say this of the interface."""
    text = json.dumps([{"linkinfo": {"info_kind": "can", "info_data": data}}])
    monkeypatch.setattr(
        subprocess, "run", lambda command, **_: subprocess.CompletedProcess(command, 0, stdout=text, stderr="")
    )
    monkeypatch.setattr(shutil, "which", lambda *_, **__: "ip")


@pytest.fixture
def kernel(monkeypatch):
    kernel = Kernel()
    monkeypatch.setattr(module.socket, "socket", kernel)
    told(monkeypatch, state="ERROR-WARNING", berr_counter={"tx": 97, "rx": 3}, bittiming={"bitrate": 500_000})
    return kernel


def opened(**settings):
    return SocketCanLink(BusSettings(interface="socketcan", channel="can0", fd=True, **settings), WallClock())


def test_frames_come_with_all_that_the_kernel_says_of_them(kernel):
    link = opened()
    kernel.arrives(0x123, b"abc", stamp=(1_763_600_000, 123_456_789))
    kernel.arrives(0x80000000 | 0x1ABCDEF, b"", stamp=(1_763_600_000, 123_456_790), flags=CONFIRM)
    kernel.arrives(0x10, bytes(range(48)), fd=True, bits=3, stamp=(1_763_600_001, 0))
    kernel.arrives(0x40000005, b"\0\0", stamp=(1_763_600_002, 0), drops=17)
    frames = link.receive()
    assert rows_of(frames) == [
        (1_763_600_000_123_456_789, 0x123, 0, b"abc"),
        (1_763_600_000_123_456_790, 0x1ABCDEF, FrameFlag.EXTENDED | FrameFlag.SENT, b""),
        (
            1_763_600_001_000_000_000,
            0x10,
            FrameFlag.FD | FrameFlag.BITRATE_SWITCH | FrameFlag.ERROR_STATE,
            bytes(range(48)),
        ),
        (1_763_600_002_000_000_000, 5, FrameFlag.REMOTE, b"\0\0"),
    ]
    health = link.health()
    assert (health.sent, health.received, health.dropped) == (1, 3, 17)


def test_a_clock_that_is_set_does_not_move_the_frames(kernel, monkeypatch):
    link = opened()
    host_ns = time.time_ns
    monkeypatch.setattr(time, "time_ns", lambda: host_ns() - 3_600_000_000_000)
    begun = host_ns()
    kernel.arrives(0x123, b"abc", stamp=divmod(time.time_ns(), 1_000_000_000))
    (row,) = rows_of(link.receive())
    assert abs(row[0] - begun) < 1_000_000_000


def test_state_and_counters_follow_the_driver_s_error_frames(kernel):
    link = opened()

    def state():
        health = link.health()
        return health.state, health.transmit_errors, health.receive_errors, health.error_frames

    assert state() == (BusState.ERROR_ACTIVE, 97, 3, 0)
    for ident, data, expected in [
        (0x204, b"\0\x20\0\0\0\0\x88\x05", (BusState.ERROR_PASSIVE, 0x88, 5, 1)),
        (0x008, b"\0\0\x01", (BusState.ERROR_PASSIVE, 0x88, 5, 2)),  # a protocol violation
        (0x040, b"", (BusState.BUS_OFF, 0x88, 5, 3)),
        (0x100, b"", (BusState.ERROR_ACTIVE, 0x88, 5, 4)),
        (0x004, b"\0\x08", (BusState.ERROR_ACTIVE, 0x88, 5, 5)),
    ]:
        kernel.arrives(0x20000000 | ident, data.ljust(8, b"\0"))
        (row,) = rows_of(link.receive())
        assert row[2] == FrameFlag.ERROR
        assert state() == expected


def test_a_vcan_says_nothing_and_nothing_is_made_up(kernel, monkeypatch):
    told(monkeypatch)
    health = opened().health()
    assert health.state is health.transmit_errors is health.receive_errors is health.load is None
    assert kernel.waiting == []


@pytest.mark.parametrize("fault", [errno.ENOBUFS, errno.EAGAIN])
def test_a_full_transmit_queue_is_a_bench_fault_and_no_wait(kernel, fault):
    link = opened()
    link.send(frame(0x123, b"abc"))
    assert kernel.sent == [struct.pack("<IB3x8s", 0x123, 3, b"abc")]
    kernel.fault = fault
    with pytest.raises(BenchFault, match=r"sent no frame: .*transmit queue is full"):
        link.send(frame(0x123))


@pytest.mark.usefixtures("kernel")
def test_an_interface_at_another_bit_rate_is_refused():
    with pytest.raises(InputError, match=r"can0 runs at 500000 bit/s .*250000.*bus\.bitrate"):
        opened(bitrate="250 kbit/s")


def test_another_data_bit_rate_is_refused_on_an_fd_bus_alone(kernel, monkeypatch):  # noqa: ARG001 (replaces sockets)
    told(monkeypatch, bittiming={"bitrate": 500_000}, data_bittiming={"bitrate": 4_000_000})
    with pytest.raises(InputError, match=r"at 4000000 bit/s in the data phase .*2000000.*bus\.data_bitrate.*fd on"):
        opened()
    SocketCanLink(BusSettings(interface="socketcan", channel="can0"), WallClock()).close()


@pytest.mark.parametrize("text", ["", "no JSON", "[]"])
def test_an_ip_that_says_nothing_leaves_state_and_rates_unknown(kernel, monkeypatch, text):  # noqa: ARG001 (likewise)
    monkeypatch.setattr(subprocess, "run", lambda command, **_: subprocess.CompletedProcess(command, 0, text, ""))
    health = opened(bitrate="250 kbit/s").health()
    assert (health.state, health.transmit_errors) == (None, None)


def test_an_ip_that_does_not_end_leaves_them_unknown(kernel, monkeypatch):  # noqa: ARG001 (likewise)
    def stuck(command, *, timeout, **_):
        raise subprocess.TimeoutExpired(command, timeout)

    monkeypatch.setattr(subprocess, "run", stuck)
    assert opened().health().state is None


@pytest.mark.parametrize(
    ("fault", "remedy"),
    [(errno.ENETDOWN, "bring it up"), (errno.ENODEV, "plug the adapter in"), (errno.EIO, "see: ip")],
)
def test_an_interface_that_goes_away_is_a_bench_fault(kernel, fault, remedy):
    link = opened()
    kernel.fault = fault
    with pytest.raises(BenchFault, match=f"cannot be read: .*; {remedy}"):
        link.receive()
    link.close()
