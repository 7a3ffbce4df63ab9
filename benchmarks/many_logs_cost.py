"""What judging many logs costs: 1 against 2 processes, and what ten million logs would.

    python benchmarks/many_logs_cost.py [--logs 40] [--rounds 2]

Each log is the raw log of a friction check of 24 s, judged as a bare log. Both commands run whole, from the start of
their processes to the Parquet files; the first log of a process also pays for loading the compiled kernels.
"""

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from pyarrow import parquet

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare

TEN_MILLION = 10_000_000


def a_session(folder):
    files = {kind: find(kind, "default") for kind in ("model", "limits")}
    job = prepare(
        JobFiles(find("scenario", "friction_check"), find("bench", "virtual_classic"), unit=files["model"], **files)
    )
    return execute(job, folder, "", 3).session.raw_log


def judged(logs, jobs, out):
    """Wall and processor time of one command, in s."""
    shutil.rmtree(out, ignore_errors=True)
    words = [sys.executable, "-m", "etb_hil", "replay", *map(str, logs), "--jobs", str(jobs), "--out", str(out)]
    start = time.perf_counter()
    child = subprocess.Popen(words, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    return time.perf_counter() - start, usage.ru_utime + usage.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=40)
    parser.add_argument("--rounds", type=int, default=2)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        raw = a_session(folder / "sessions")
        logs = [folder / f"log{number}.blf" for number in range(options.logs)]
        for log in logs:
            shutil.copyfile(raw, log)
        size = raw.stat().st_size
        walls = {}
        for _ in range(options.rounds):
            for jobs in (1, 2):
                wall, processor = judged(logs, jobs, folder / "out")
                walls.setdefault(jobs, []).append(wall)
                print(
                    f"{options.logs} logs, {jobs} processes: {wall:.1f} s wall, {processor:.1f} s processor", flush=True
                )
        table = parquet.read_table(folder / "out" / "logs.parquet")
        each = statistics.median(table["processor_s"].to_pylist())
        print(f"2 processes are {min(walls[1]) / min(walls[2]):.2f} times as fast as 1")
        print(f"a log: {each:.3f} s processor (median), {size / 1e6:.2f} MB of BLF")
        hours, row = TEN_MILLION * each / 3600, (folder / "out" / "logs.parquet").stat().st_size / options.logs
        print(f"ten million: {hours:.0f} h of one core, {hours / 96:.1f} h of 96")
        print(f"what they read: {TEN_MILLION * size / 1e12:.1f} TB")
        print(f"their table: at most {TEN_MILLION * row / 1e9:.1f} GB")


if __name__ == "__main__":
    main()
