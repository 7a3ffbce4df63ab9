"""What a link over SocketCAN does when its interface is flooded, goes down, comes back and is deleted."""

import subprocess

import numpy as np
from bus_tools import block, frame

from etb_hil.base.clock import WallClock
from etb_hil.base.errors import BenchFault
from etb_hil.canio.bus.bus_settings import BusSettings
from etb_hil.canio.bus.link import open_link
from etb_hil.canio.frames import concatenate_frames


def fault_of(action):
    try:
        action()
    except BenchFault as error:
        return str(error)
    raise AssertionError("no fault")


def arrived(link, clock, count):
    parts, deadline = [link.receive()], clock.now_ns() + 10_000_000_000
    while sum(map(len, parts)) < count and clock.now_ns() < deadline:
        parts.append(link.receive())
    frames = concatenate_frames(parts)
    assert len(frames) == count, f"{len(frames)} frames of {count}"
    return frames


def main():
    clock = WallClock()
    settings = BusSettings(interface="socketcan", channel="vcan0")
    one, other = open_link(settings, clock), open_link(settings, clock)

    burst = block([(0, i % 2048, 0, i.to_bytes(4, "big")) for i in range(3000)])
    before = clock.now_ns()
    one.send(burst)
    got, own = arrived(other, clock, 3000), arrived(one, clock, 3000)
    np.testing.assert_array_equal(got.data, burst.data)
    np.testing.assert_array_equal(own.stamp_ns, got.stamp_ns)  # the kernel's, to the nanosecond
    assert before <= got.stamp_ns[0] <= got.stamp_ns[-1] <= clock.now_ns()
    assert len(np.unique(got.stamp_ns % 1000)) > 100, "stamps are coarser than nanoseconds"
    assert (other.health().dropped, other.health().state) == (0, None)

    flood = block([(0, 1, 0, b"12345678")] * 500)
    for _ in range(50):
        one.send(flood)
        arrived(one, clock, 500)
    kept = 0
    while len(part := other.receive()):
        kept += len(part)
    single = frame(1, b"12345678")
    one.send(single)
    arrived(other, clock, 1)
    assert other.health().dropped == 25_000 - kept > 0, (other.health(), kept)

    subprocess.run(["ip", "link", "set", "vcan0", "down"], check=True)
    assert "bring it up: ip link set vcan0 up" in fault_of(lambda: one.send(single))
    assert "Network is down" in fault_of(other.receive)
    subprocess.run(["ip", "link", "set", "vcan0", "up"], check=True)
    one.send(single)
    arrived(other, clock, 1)
    subprocess.run(["ip", "link", "delete", "vcan0"], check=True)
    assert "plug the adapter in" in fault_of(lambda: one.send(single))
    assert "plug the adapter in" in fault_of(other.receive)
    assert "cannot be opened: No such device" in fault_of(lambda: open_link(settings, clock))
    print("all faults seen")


if __name__ == "__main__":
    main()
