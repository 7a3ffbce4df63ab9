"""Two processes on vcan0: one sends classic and FD frames, the other answers each with its bytes inverted."""

from __future__ import annotations

import subprocess
import sys
import time

import can

QUIT = 0x7FF


def answer() -> None:
    with can.Bus(interface="socketcan", channel="vcan0", fd=True) as bus:
        print("ready", flush=True)
        while (got := bus.recv(10)) is not None and got.arbitration_id != QUIT:
            data = bytes(0xFF ^ byte for byte in got.data)
            bus.send(
                can.Message(
                    arbitration_id=got.arbitration_id + 1,
                    data=data,
                    is_fd=got.is_fd,
                    bitrate_switch=got.bitrate_switch,
                    is_extended_id=got.is_extended_id,
                )
            )


def ask() -> None:
    with (
        can.Bus(interface="socketcan", channel="vcan0", fd=True) as bus,
        subprocess.Popen([sys.executable, __file__, "answer"], stdout=subprocess.PIPE) as other,
    ):
        assert other.stdout is not None
        other.stdout.readline()
        for number in range(200):
            fd = bool(number % 2)
            data = bytes((number + i) & 0xFF for i in range(64 if fd else 8))
            sent = can.Message(arbitration_id=0x100, data=data, is_fd=fd, bitrate_switch=fd, is_extended_id=False)
            bus.send(sent)
            got = bus.recv(10)
            assert got is not None, f"no answer to frame {number}"
            assert (got.arbitration_id, got.is_fd, got.bitrate_switch) == (0x101, fd, fd), got
            assert bytes(got.data) == bytes(0xFF ^ byte for byte in data), got
            assert abs(got.timestamp - time.time()) < 60, got
        bus.send(can.Message(arbitration_id=QUIT, is_extended_id=False))
    assert other.returncode == 0
    print("200 frames answered")


if __name__ == "__main__":
    answer() if sys.argv[1:] == ["answer"] else ask()
