"""What kill -9 leaves: frames of a run killed at random, phases in the store, and whether the session replays.

    python benchmarks/power_loss.py --runs 200

A child runs the friction check and tells, over a pipe, the stamp of the newest frame it has seen and the machine's
time; it is killed at a random moment. Everything that it had seen 100 ms before must be in the raw log as python-can
reads it, every phase that ended must be in the store, and the session must replay.
"""

import argparse
import os
import random
import signal
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import can

from etb_hil.replays.session_replay import replay

ALLOWED_S = 0.1
CHILD = """
import os, struct, sys, time
from pathlib import Path
from faults_study import job_of
from etb_hil.bench.job import execute
from etb_hil.bench.tap import Tap
pipe, bench, folder = int(sys.argv[1]), sys.argv[2], Path(sys.argv[3])
receive = Tap.receive
def told(self):
    blocks = receive(self)
    if blocks:
        newest = max(int(block.stamp_ns[-1]) for block in blocks)
        os.write(pipe, struct.pack("<qd", newest, time.monotonic()))
    time.sleep(0.002)  # about real time, so that 100 ms of the machine are some of the run
    return blocks
job = job_of(bench, "default")
Tap.receive = told
os.write(pipe, struct.pack("<qd", -1, time.monotonic()))
execute(job, folder, "", 1)
"""


def killed_run(folder, bench, after_s):
    """Return the stamp that had to be safe, and the session's folder, of a run killed `after_s` after its start."""
    reading, writing = os.pipe()
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    child = subprocess.Popen(
        [sys.executable, "-c", CHILD, str(writing), bench, str(folder)], pass_fds=[writing], env=environment
    )
    os.close(writing)
    os.read(reading, 16)
    time.sleep(after_s)
    killed_at = time.monotonic()
    child.send_signal(signal.SIGKILL)
    child.wait()
    told = b""
    while part := os.read(reading, 1 << 20):
        told += part
    os.close(reading)
    entries = list(struct.iter_unpack("<qd", told[: len(told) // 16 * 16]))
    safe = [stamp for stamp, at in entries if at <= killed_at - ALLOWED_S]
    sessions = [path for path in folder.iterdir() if path.is_dir()]
    return (max(safe) if safe else -1), (sessions[0] if sessions else None)


def check(safe_ns, session):
    """Return what was lost, in words, or nothing; and by how much of the run's time the log ends behind `safe_ns`."""
    if session is None or not (session / "raw.blf").exists():
        return ("" if safe_ns < 0 else "no session"), 0.0
    with can.BLFReader(session / "raw.blf") as reader:
        stamps = [message.timestamp for message in reader]
    last = max(stamps) if stamps else -1.0
    if safe_ns >= 0 and last + 2e-3 < safe_ns * 1e-9:
        return f"log ends at {last:.3f} s, {safe_ns * 1e-9:.3f} s had to be in it", last - safe_ns * 1e-9
    again = replay(session)
    if again.results.unit.verdict is not None and again.results.bench.reason_id == "cut_short":
        return "a killed run was given a verdict", 0.0
    return "", last - safe_ns * 1e-9


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--bench", default="virtual_classic")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng = random.Random(options.seed)  # noqa: S311 (when to kill is no secret)
    lost, ends = [], []
    for number in range(options.runs):
        with tempfile.TemporaryDirectory() as folder:
            safe_ns, session = killed_run(Path(folder), options.bench, rng.uniform(0.3, 8.0))
            problem, ahead = check(safe_ns, session)
        ends.append(ahead)
        if problem:
            lost.append(problem)
            print(f"run {number}: {problem}", flush=True)
    print(f"{options.bench}: {options.runs} runs killed, {len(lost)} lost something; load {os.getloadavg()[0]:.1f}")
    return bool(lost)


if __name__ == "__main__":
    raise SystemExit(main())
