"""Speed of the virtual bus beside python-can's `virtual`, in one process; medians over interleaved rounds.

    python benchmarks/bus_speed.py [--rounds 7]

Each way moves the same 8-byte frames from one side of a bus to another. Ours counts every bit of each frame, arbitrates
and stamps in virtual time; python-can's `virtual` puts a copy into a queue. Then the lock-step pattern of a bench: a
node that sends 2 frames a millisecond, 2 commands every 10 ms, in sleeps of 10 ms.
"""

import argparse
import statistics
import time

import can
import numpy as np

from etb_hil.canio.bus.link import VirtualLink
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.canio.frames import FrameBlock

FRAMES = 20_000
BLOCK = 1_000
SLEEPS = 2_000
PERIOD_NS = 10_000_000


def traffic(count, seed=0):
    rng = np.random.default_rng(seed)
    return FrameBlock(
        np.zeros(count, np.int64),
        rng.integers(0, 2048, count).astype(np.uint32),
        np.zeros(count, np.uint8),
        np.full(count, 8, np.uint8),
        rng.integers(0, 256, (count, 8)).astype(np.uint8),
        np.zeros(count, np.uint8),
    )


def columns():
    network = VirtualNetwork(1_000_000)
    sender, receiver = VirtualLink(network), VirtualLink(network)
    frames = traffic(BLOCK)
    count = 50 * FRAMES
    start = time.perf_counter()
    for _ in range(count // BLOCK):
        sender.send(frames)
        network.sleep_until_ns(network.now_ns() + BLOCK * 140_000)
        assert len(receiver.receive()) == len(sender.receive()) == BLOCK
    return count / (time.perf_counter() - start)


def messages(interface):
    options = {"interface": interface, "channel": "speed"}
    messages = [can.Message(arbitration_id=0x123, data=bytes(8), is_extended_id=False) for _ in range(10)]
    with can.Bus(**options) as one, can.Bus(**options) as other:
        start = time.perf_counter()
        for _ in range(FRAMES // len(messages)):
            for message in messages:
                one.send(message)
            for _ in messages:
                assert other.recv(1.0) is not None
        return FRAMES / (time.perf_counter() - start)


class Stream:
    """Hands over 2 frames each millisecond, as the controller does."""

    def __init__(self, rows):
        self._frames = traffic(rows)
        self._frames.stamp_ns[:] = np.arange(rows) // 2 * 1_000_000 + 1_000_000
        self._frames.ident[:] = 0x200 + np.arange(rows) % 2
        self._row = 0

    def run(self, until_ns, _inbox):
        first, self._row = self._row, until_ns // 1_000_000 * 2
        return self._frames.select(slice(first, self._row))


def lock_step():
    network = VirtualNetwork(500_000)
    node = Stream(SLEEPS * 20)
    network.attach(node)
    link = VirtualLink(network)
    commands = traffic(2)
    commands.ident[:] = (0x100, 0x101)
    count = 0
    start = time.perf_counter()
    for index in range(1, SLEEPS + 1):
        link.send(commands)
        network.sleep_until_ns(index * PERIOD_NS)
        count += len(link.receive())
    spent = time.perf_counter() - start
    assert count > 21 * SLEEPS
    assert link.health().dropped == 0
    return spent / SLEEPS * 1e6


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7)
    rounds = parser.parse_args().rounds
    columns(), lock_step()  # compile
    results = [(columns(), messages("etb_virtual"), messages("virtual"), lock_step()) for _ in range(rounds)]
    ours, bus, peer, sleep = (statistics.median(values) for values in zip(*results, strict=True))
    print(f"python-can virtual, messages:       {peer / 1e3:8.0f} thousand frames a second")
    print(f"etb_virtual by python-can, messages: {bus / 1e3:7.0f} thousand, {bus / peer:.2f} times the peer")
    print(f"etb_virtual in columns:             {ours / 1e3:8.0f} thousand, {ours / peer:.1f} times the peer")
    print(f"lock-step, 22 frames in 10 ms:      {sleep:8.1f} us a sleep, link and node included")


if __name__ == "__main__":
    main()
