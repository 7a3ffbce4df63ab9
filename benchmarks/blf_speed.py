"""Speed of our BLF log beside python-can's writer and reader, in one process: processor time, medians over interleaved
rounds.

    python benchmarks/blf_speed.py [--rounds 3] [--frames 200000]

Traffic as of a bench: slow currents and angles with counters and checksums at 1 kHz each, and 30 % unrelated frames.
"""

import argparse
import statistics
import tempfile
import time
import zlib
from pathlib import Path

import can
import numpy as np

from etb_hil.canio.frames import FrameBlock
from etb_hil.canio.logs.blf import BlfLog, read_blf
from etb_hil.canio.messages import to_message

START = 1_763_600_000_000_000_000
BLOCK = 22  # frames of 10 ms
FLUSH = 5  # blocks: every 50 ms


def traffic(count):
    rng = np.random.default_rng(0)
    tick = np.arange(count)
    stamps = START + tick * 348_000 + rng.integers(0, 9000, count)
    angle = (8000 + 6000 * np.sin(tick * 1e-4)).astype("<u4")
    current = (2000 + 500 * np.cos(tick * 1e-4) + rng.normal(0, 3, count)).astype("<u2")
    data = np.zeros((count, 8), np.uint8)
    data[:, 0] = rng.integers(0, 256, count)  # the checksum
    data[:, 1] = tick & 15
    data[:, 2:6] = angle.view(np.uint8).reshape(-1, 4)
    data[:, 6:8] = current.view(np.uint8).reshape(-1, 2)
    ident = np.where(tick % 2, 0x120, 0x121)
    other = rng.random(count) < 0.3
    ident = np.where(other, 0x300 + tick % 8, ident)
    data[other, 2:] = 0
    return FrameBlock(
        stamps, ident.astype(np.uint32), np.zeros(count, np.uint8), np.full(count, 8, np.uint8), data,
        np.zeros(count, np.uint8),
    )  # fmt: skip


def seconds(action):
    start = time.process_time()
    result = action()
    return time.process_time() - start, result


def write_ours(path, frames):
    log = BlfLog(path, START)
    log.write(frames)
    log.close()


def write_live(path, frames):
    log = BlfLog(path, START)
    for number, first in enumerate(range(0, len(frames), BLOCK)):
        log.write(frames.select(slice(first, first + BLOCK)))
        if number % FLUSH == 0:
            log.flush()
    log.close()


def write_peer(path, messages):
    with can.BLFWriter(path) as writer:
        for message in messages:
            writer.on_message_received(message)


def read_ours(path):
    return sum(map(len, read_blf(path)))


def read_peer(path):
    with can.BLFReader(path) as reader:
        return sum(1 for _ in reader)


def inflate(path):
    """The floor: what zlib alone takes for the same file."""
    raw, position = path.read_bytes(), 144
    while position < len(raw):
        size = int.from_bytes(raw[position + 8 : position + 12], "little")
        zlib.decompress(raw[position + 32 : position + size])
        position += size + size % 4


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--frames", type=int, default=200_000)
    options = parser.parse_args()
    frames = traffic(options.frames)
    messages = [to_message(frames, row) for row in range(len(frames))]
    spent = {}
    with tempfile.TemporaryDirectory() as folder:
        ours, live, peer = (Path(folder) / f"{name}.blf" for name in ("ours", "live", "peer"))
        for _ in range(options.rounds):
            for name, action in (
                ("write, python-can", lambda: write_peer(peer, messages)),
                ("write, ours, one block", lambda: write_ours(ours, frames)),
                ("write, ours, live: flushed every 50 ms", lambda: write_live(live, frames)),
                ("read, python-can", lambda: read_peer(ours)),
                ("read, ours", lambda: read_ours(ours)),
                ("read, ours, the live file", lambda: read_ours(live)),
                ("zlib alone", lambda: inflate(ours)),
            ):
                spent.setdefault(name, []).append(seconds(action)[0])
            assert read_ours(ours) == read_ours(live) == read_peer(live) == len(frames)
        size = ours.stat().st_size, peer.stat().st_size
    rate = {name: len(frames) / statistics.median(times) / 1e6 for name, times in spent.items()}
    for name, value in rate.items():
        against = rate["write, python-can" if name.startswith("write") else "read, python-can"]
        print(f"{name:40s} {value:7.2f} million frames a second, {value / against:5.1f} times python-can")
    print(f"size of the file: {size[0] / size[1]:.2f} of python-can's")


if __name__ == "__main__":
    main()
