"""Simulated seconds a second of the whole bench in lock-step, session and verdict included, and where the time goes.

python benchmarks/lockstep_speed.py [--bench virtual_classic] [--runs 5] [--profile]
"""

import argparse
import cProfile
import pstats
import statistics
import tempfile
import time
from pathlib import Path

from etb_hil.base.collector import collect_rarely
from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bench", default="virtual_classic")
    parser.add_argument("--scenario", default="friction_check")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--profile", action="store_true")
    options = parser.parse_args()
    collect_rarely()  # as the command does
    job = prepare(
        JobFiles(
            find("scenario", options.scenario),
            find("bench", options.bench),
            find("model", "default"),
            find("limits", "default"),
            find("model", "default"),
        )
    )
    with tempfile.TemporaryDirectory() as folder:
        execute(job, Path(folder), "", 0)  # compiles
        rates, shares = [], []
        for seed in range(options.runs):
            wall, cpu = time.perf_counter(), time.process_time()
            finished = execute(job, Path(folder), "", seed)
            wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
            simulated = finished.results.duration_s
            frames = sum(message.frames for message in finished.results.bus.messages)
            rates.append(simulated / cpu)
            shares.append(simulated / wall)
        print(f"{options.bench}, {options.scenario}: {simulated:.1f} s simulated, {frames} frames, one core")
        print(f"simulated s per CPU s : median {statistics.median(rates):.1f} (best {max(rates):.1f})")
        print(f"simulated s per wall s: median {statistics.median(shares):.1f} (best {max(shares):.1f})")
        if options.profile:
            profile = cProfile.Profile()
            profile.runcall(execute, job, Path(folder), "", 0)
            pstats.Stats(profile).sort_stats("tottime").print_stats(30)


if __name__ == "__main__":
    main()
