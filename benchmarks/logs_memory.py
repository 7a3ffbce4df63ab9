"""Whole processes over logs, from cold: wall and processor time, and the most memory that they held.

    python benchmarks/logs_memory.py [--frames 2000000] [--runs 160] [--rounds 3] [--peer] [--gib 10 --at FOLDER]

1. a BLF log of two million frames to columns of float64, beside python-can + cantools (--peer: takes a minute); with
   and without the extra `logs`, whose libdeflate unpacks faster than zlib and whose asammdf python-can imports;
2. the same frames in an MF4 log, beside asammdf;
3. `etb-hil replay` of a friction check recorded again and again, against the time that it lasted: the memory must not
   grow with the log;
4. with --gib alone, `etb-hil replay` of a log of that size, as a car's gateway records it: the bench's bus on
   channel 0, and on channel 1 an FD bus of 4000 frames a second with 64 random bytes each. It is deleted afterwards.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from log_traffic import Traffic

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.canio.frames import FrameBlock, FrameFlag, concatenate_frames
from etb_hil.canio.logs.blf import BlfLog, read_blf
from etb_hil.canio.logs.mf4_writer import Mf4Log

COLD = """
import sys
{without}
from cantools.database.can import Database
from pathlib import Path
from etb_hil.canio.logs.reading import read_log
from etb_hil.canio.columns import ColumnDecoder
from etb_hil.canio.frames import gathered
database = Database(strict=False)
database.add_dbc_file({dbc!r})
decoder = ColumnDecoder(database.messages)
columns = [part for block in gathered(read_log(Path({log!r}))) for part in decoder.push(block)]
assert sum(len(part.stamp_ns) for part in columns) > 1000
"""
PEER = """
import can, cantools, numpy
known = {{m.frame_id: m for m in cantools.database.load_file({dbc!r}).messages}}
columns = {{(m.name, s.name): [] for m in known.values() for s in m.signals}}
with can.LogReader({log!r}) as reader:
    for frame in reader:
        message = known.get(frame.arbitration_id)
        if message is not None:
            for name, value in message.decode(frame.data, decode_choices=False).items():
                columns[message.name, name].append(value)
columns = {{key: numpy.array(values) for key, values in columns.items()}}
"""
BY_ASAMMDF = """
import warnings, asammdf
warnings.simplefilter("ignore")
with asammdf.MDF({log!r}) as mdf:
    extracted = mdf.extract_bus_logging({{"CAN": [({dbc!r}, 0)]}})
    columns = [signal for group in range(len(extracted.groups)) for signal in extracted.get_group(group).columns]
"""
BARE = "sys.modules['asammdf'] = sys.modules['deflate'] = None"
AS_A_COMMAND = "sys.modules['asammdf'] = None"


AND_MEMORY = """
import sys
with open('/proc/self/status') as status:  # getrusage would count the parent's memory from before the exec
    print(next(line for line in status if line.startswith('VmHWM')).split()[1], file=sys.stderr)
"""
REPLAY = "from etb_hil.cli.main import main\nmain({words!r})\n"


def measured(script):
    """Wall and processor time in s and the largest memory in MB of a Python process."""
    start = time.perf_counter()
    words = [sys.executable, "-c", script + AND_MEMORY]
    child = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    said = child.stderr.read()
    child.stderr.close()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    return time.perf_counter() - start, usage.ru_utime + usage.ru_stime, int(said.split()[-1]) / 1024


def write_log(path, count):
    traffic, written, log = Traffic(), 0, None
    while written < count:
        block = traffic.block(2000)
        log = log or BlfLog(path, int(block.stamp_ns[0]))
        log.write(block)
        written += len(block)
    log.close()
    return traffic


def write_tiled(path, frames, repeats):
    """A run of a bench again and again, as a bench in production records it."""
    span = int(frames.stamp_ns[-1] - frames.stamp_ns[0]) + 1_000_000_000
    log = BlfLog(path, int(frames.stamp_ns[0]))
    for turn in range(repeats):
        log.write(replace(frames, stamp_ns=frames.stamp_ns + turn * span))
    log.close()
    return span * repeats * 1e-9


def a_run(folder):
    """The frames of a friction check."""
    files = {kind: find(kind, "default") for kind in ("model", "limits")}
    job = prepare(
        JobFiles(find("scenario", "friction_check"), find("bench", "virtual_classic"), unit=files["model"], **files)
    )
    return concatenate_frames(read_blf(execute(job, folder, "", 3).session.raw_log))


def write_gateway(path, run, size):
    """A log of so many bytes: a run of the bench again and again, and a busy FD bus beside it; frames and seconds."""
    span = int(run.stamp_ns[-1] - run.stamp_ns[0]) + 1_000_000_000
    stamps = np.arange(run.stamp_ns[0], run.stamp_ns[0] + span, 250_000)
    count, rng = len(stamps), np.random.default_rng(11)
    flags = np.full(count, FrameFlag.FD | FrameFlag.BITRATE_SWITCH, np.uint8)
    other = FrameBlock(
        stamps, rng.integers(0x300, 0x340, count).astype(np.uint32), flags, np.full(count, 64, np.uint8),
        rng.integers(0, 256, (count, 64), np.uint8), np.ones(count, np.uint8),
    )  # fmt: skip
    both = concatenate_frames([run, other])
    both = both.select(np.argsort(both.stamp_ns, kind="stable"))
    log, turn = BlfLog(path, int(both.stamp_ns[0])), 0
    while path.stat().st_size < size:
        log.write(replace(both, stamp_ns=both.stamp_ns + turn * span))
        turn += 1
    log.close()
    return len(both) * turn, span * turn * 1e-9


def gateway(folder, gib):
    """Replay a log of so many GiB."""
    with tempfile.TemporaryDirectory(dir=folder) as place:
        log = Path(place) / "gateway.blf"
        count, lasted = write_gateway(log, a_run(Path(place)), gib * 2**30)
        title = f"replay of {count / 1e6:.0f} M frames, {log.stat().st_size / 2**30:.2f} GiB, {lasted / 3600:.1f} h"
        show(title, REPLAY.format(words=["replay", str(log)]), 1, lasted)


def show(title, script, rounds, lasted=None):
    """Print the quickest of some rounds, and the most memory of all."""
    figures = [measured(script) for _ in range(rounds)]
    wall, processor, memory = min(f[0] for f in figures), min(f[1] for f in figures), max(f[2] for f in figures)
    more = f", {lasted / processor:.0f} times real time" if lasted else ""
    print(f"{title:64s}{wall:8.2f} s wall {processor:8.2f} s processor {memory:7.0f} MB{more}", flush=True)


def write_mf4(path, blf):
    frames = concatenate_frames(read_blf(blf))
    log = Mf4Log(path, int(frames.stamp_ns[0]))
    log.write(frames)
    log.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=2_000_000)
    parser.add_argument("--runs", type=int, default=160)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--peer", action="store_true")
    parser.add_argument("--gib", type=float)
    parser.add_argument("--at", type=Path, help="folder with room for the log (default: that of temporary files)")
    options = parser.parse_args()
    if options.gib:
        gateway(options.at, options.gib)
        return
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.blf"
        dbc = str(write_log(log, options.frames).dialect.path)
        for title, without in (
            ("zlib alone", BARE),
            ("libdeflate", AS_A_COMMAND),
            ("libdeflate, asammdf imported", ""),
        ):
            script = COLD.format(dbc=dbc, log=str(log), without=without)
            show(f"{options.frames} frames of BLF to columns, {title}", script, options.rounds)
        show("numpy imported, nothing else", "import numpy", options.rounds)
        if options.peer:
            show("python-can + cantools", PEER.format(dbc=dbc, log=str(log)), 1)
        mf4 = log.with_suffix(".mf4")
        write_mf4(mf4, log)
        script = COLD.format(dbc=dbc, log=str(mf4), without=AS_A_COMMAND)
        show(f"{options.frames} frames of MF4 to columns", script, options.rounds)
        show("asammdf", BY_ASAMMDF.format(dbc=dbc, log=str(mf4)), 1)
        run = a_run(Path(folder))
        for repeats in (1, options.runs // 4, options.runs):
            lasted = write_tiled(log, run, repeats)
            size = log.stat().st_size / 2**20
            title = f"replay of {len(run) * repeats} frames, {size:.0f} MB, {lasted:.0f} s of a bench"
            show(title, REPLAY.format(words=["replay", str(log)]), 1, lasted)


if __name__ == "__main__":
    main()
