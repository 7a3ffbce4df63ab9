"""Logs read and decoded beside python-can + cantools and asammdf, in one process: frames a second of processor time.

    python benchmarks/logs_speed.py [--rounds 5] [--frames 300000] [--peer-frames 20000]

The quickest of interleaved rounds; the peers read a shorter file of the same traffic, BLF and MF4 as python-can writes
them. `columns` is every signal of the DBC file into columns of float64; 30 % of the frames are unrelated. `zlib` is the
same without libdeflate, which comes with the extra `logs` (asammdf uses ISA-L). The limit is what zlib, or a search for
the ends of lines, takes alone.
"""

import argparse
import tempfile
import time
import warnings
import zlib
from pathlib import Path

import asammdf
import can
import cantools
import numpy as np
from log_traffic import Traffic

from etb_hil.canio.dbc.columns import ColumnDecoder
from etb_hil.canio.dbc.decoder import Decoder
from etb_hil.canio.frames import FrameBlock, gathered
from etb_hil.canio.logs import inflate as inflating
from etb_hil.canio.logs.blf import read_blf
from etb_hil.canio.logs.reading import read_log
from etb_hil.canio.logs.writing import write_log
from etb_hil.canio.messages import to_message

WRITTEN_BY_US = (".blf", ".mf4")
SIXTEEN = 'VERSION ""\nBU_: A\nBO_ 256 Pairs: 64 A\n' + "".join(
    f' SG_ I{k} : {32 * k}|16@1- (0.001,0) [0|0] "A" A\n SG_ A{k} : {32 * k + 16}|16@1- (0.0005,0) [0|0] "rad" A\n'
    for k in range(16)
)


def text_of(frames, suffix):
    """Lines as the usual tools write them; python-can's writers would take minutes."""
    since = (frames.stamp_ns - frames.stamp_ns[0]).tolist()
    fd = frames.data.shape[1] > 8
    rows = zip(since, frames.stamp_ns.tolist(), frames.ident.tolist(), frames.length.tolist(), frames.data, strict=True)
    if suffix == ".log":
        mark = "##1" if fd else "#"
        return "".join(
            f"({t * 1e-9:.6f}) can0 {i:03X}{mark}{d[:n].tobytes().hex().upper()}\n" for _, t, i, n, d in rows
        )
    head = "date Sat Sep 30 15:06:13.191 2017\nbase hex  timestamps absolute\ninternal events logged\n"
    return head + "".join(
        f"{s * 1e-9:9.6f} 1  {i:<15X} Rx   d {n:x} {d[:n].tobytes().hex(' ').upper()}\n" for s, _, i, n, d in rows
    )


def write(path, frames):
    if path.suffix in WRITTEN_BY_US:
        log = write_log(path, int(frames.stamp_ns[0]))
        log.write(frames)
        log.close()
    else:
        path.write_text(text_of(frames, path.suffix))


def write_as_peers(path, frames):
    """The same frames in the way in which python-can packs them; its MF4 writer would take minutes."""
    if path.suffix == ".mf4":
        write(path, frames)
        with asammdf.MDF(path) as mdf:
            mdf.save(path, overwrite=True, compression=2)
    elif path.suffix == ".blf":
        with can.Logger(path) as logger:
            for row in range(len(frames)):
                logger.on_message_received(to_message(frames, row))
    else:
        write(path, frames)


def pairs(count):
    """FD frames of 64 bytes with 16 pairs of current and angle, among classic ones as three to ten."""
    rng = np.random.default_rng(6)
    fd = np.arange(count) % 10 < 7
    data = np.zeros((count, 64), np.uint8)
    phase = (np.arange(count)[:, None] * 16 + np.arange(16)) * 1e-4
    words = np.empty((count, 32), "<i2")
    words[:, ::2] = 2000 * np.cos(phase) + rng.normal(0, 3, phase.shape)
    words[:, 1::2] = 12000 * np.sin(phase) + rng.normal(0, 1, phase.shape)
    data[fd] = words.view(np.uint8)[fd]
    return FrameBlock(
        1_763_600_000_000_000_000 + np.arange(count) * 800_000, np.where(fd, 256, 0x300).astype(np.uint32),
        np.where(fd, 8, 0).astype(np.uint8), np.where(fd, 64, 8).astype(np.uint8), data, np.zeros(count, np.uint8),
    )  # fmt: skip


def spent(action):
    start = time.process_time()
    action()
    return time.process_time() - start


def ours(path, messages):
    decoder = ColumnDecoder(messages)
    return [decoder.push(block) for block in gathered(read_log(path))]


def ours_zlib(path, messages):
    fast, inflating.libdeflate = inflating.libdeflate, None
    try:
        return ours(path, messages)
    finally:
        inflating.libdeflate = fast


def ours_judged(path, dialect):
    decoder = Decoder(dialect)
    return [decoder.push(block) for block in gathered(read_log(path))]


def by_cantools(path, messages):
    known = {message.frame_id: message for message in messages}
    columns = {(m.name, s.name): [] for m in messages for s in m.signals}
    with can.LogReader(path) as reader:
        for frame in reader:
            message = known.get(frame.arbitration_id)
            if message is not None:
                for name, value in message.decode(frame.data, decode_choices=False).items():
                    columns[message.name, name].append(value)
    return {key: np.array(values) for key, values in columns.items()}


def by_asammdf(path, dbc):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with asammdf.MDF(path) as mdf:
            extracted = mdf.extract_bus_logging({"CAN": [(dbc, 0)]})
            return [signal for group in range(len(extracted.groups)) for signal in extracted.get_group(group).columns]


def inflate(path):
    raw, position = path.read_bytes(), 144
    while position < len(raw):
        size = int.from_bytes(raw[position + 8 : position + 12], "little")
        zlib.decompress(raw[position + 32 : position + size])
        position += size + size % 4


def count_lines(path):
    return path.read_bytes().count(b"\n")


def write_peer(path, count):
    """python-can's writer for the same frames, from messages that exist already."""
    frames = Traffic().frames(count)
    messages = [to_message(frames, row) for row in range(len(frames))]

    def action():
        with can.Logger(path) as logger:
            for message in messages:
                logger.on_message_received(message)

    return action


def compare(title, path, frames, peer_frames, dbc, dialect, rounds):
    messages = cantools.database.load_file(dbc).messages
    small = path.with_name(f"small{path.suffix}")
    write_as_peers(path, frames)
    write_as_peers(small, peer_frames)
    n, m = len(frames), len(peer_frames)
    packed = path.suffix in WRITTEN_BY_US
    cases = {"ours, columns": (n, lambda: ours(path, messages))}
    if packed:
        cases["ours, columns, zlib"] = (n, lambda: ours_zlib(path, messages))
    if dialect:
        cases["ours, checked and clocked"] = (n, lambda: ours_judged(path, dialect))
    cases["python-can + cantools"] = (m, lambda: by_cantools(small, messages))
    if path.suffix == ".mf4":
        cases["asammdf"] = (n, lambda: by_asammdf(path, dbc))
    else:
        cases["limit"] = (n, lambda: inflate(path) if packed else count_lines(path))
    times = {name: [] for name in cases}
    for turn in range(rounds + 1):
        for name, (_, action) in cases.items():
            seconds = spent(action)
            if turn:  # the first compiles
                times[name].append(seconds)
    rates = {name: cases[name][0] / min(times[name]) / 1e6 for name in cases}
    print(f"{title} ({path.stat().st_size / n:.0f} bytes a frame)")
    zlib_rate = rates.get("ours, columns, zlib")
    for name, rate in rates.items():
        ratio = f"ours is {rates['ours, columns'] / rate:6.1f} times as fast"
        ratio += f", {zlib_rate / rate:6.1f} with zlib" if zlib_rate else ""
        print(f"  {name:28s}{rate:8.3f} M frames/s   {'' if name.startswith('ours') else ratio}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--frames", type=int, default=300_000)
    parser.add_argument("--peer-frames", type=int, default=20_000)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for title, suffix, fd in (
            ("BLF", ".blf", False),
            ("ASC", ".asc", False),
            ("candump", ".log", False),
            ("MF4, packed and transposed", ".mf4", False),
            ("BLF, FD bursts of 10 samples", ".blf", True),
            ("candump, FD bursts", ".log", True),
        ):
            traffic = Traffic(fd=fd)
            frames = traffic.frames(options.frames // 3 if fd else options.frames)
            path = Path(folder) / f"log{suffix}"
            few = frames.select(slice(options.peer_frames))
            compare(title, path, frames, few, str(traffic.dialect.path), traffic.dialect, options.rounds)
        dbc = Path(folder) / "pairs.dbc"
        dbc.write_text(SIXTEEN)
        frames = pairs(options.frames // 3)
        few = frames.select(slice(options.peer_frames))
        path = Path(folder) / "pairs.blf"
        compare("BLF, FD frames of 16 pairs and classic ones", path, frames, few, str(dbc), None, options.rounds)
        frames = Traffic().frames(options.frames)
        for suffix in WRITTEN_BY_US:
            path = Path(folder) / f"written{suffix}"
            count = options.peer_frames // (10 if suffix == ".mf4" else 1)
            peer = write_peer(path, count)
            taken = [(spent(lambda: write(path, frames)), spent(peer)) for _ in range(options.rounds)]  # noqa: B023
            mine, theirs = map(min, zip(*taken, strict=True))
            mine, theirs = len(frames) / mine / 1e6, count / theirs / 1e6
            print(f"writing {suffix}: ours {mine:.3f}, python-can {theirs:.3f} M frames/s, {mine / theirs:.0f} times")
            if suffix == ".mf4":
                inflating.libdeflate = None
                slow = len(frames) / min(spent(lambda: write(path, frames)) for _ in range(options.rounds)) / 1e6  # noqa: B023
                print(f"  with zlib {slow:.3f} M frames/s, {slow / theirs:.0f} times")
        assert sum(map(len, read_blf(Path(folder) / "written.blf"))) > 0


if __name__ == "__main__":
    main()
