"""Processor seconds and memory of the commands that people wait for, beside the imports that they all need.

python benchmarks/where_users_wait.py [--runs 5] [--first]

Each command is a process of its own, started warm, in turn with the peer; medians. The ratio to the peer holds on other
machines too. `--first` also measures the first start, in an empty cache, with two processors and with one.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PEER = [sys.executable, "-c", "import numpy, numba, matplotlib"]
ETB = [sys.executable, "-m", "etb_hil.cli.main"]
HISTORY = 10  # runs
# As a user's shell has it: Python keeps the modules that it has compiled.
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--first", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if options.first:
            first_start(folder, len(os.sched_getaffinity(0)))
            first_start(folder, 1)
        for _ in range(HISTORY):
            cost([*ETB, "run", "--out", "sessions"], folder)
        session = str(min((folder / "sessions").glob("*/report.html")).parent)
        commands = {
            "run": ["run", "--out", "others"],
            "replay SESSION": ["replay", session],
            "check": ["check"],
            "simulate": ["simulate", "--out", "simulated.csv"],
            "plot": ["plot", session],
            "schema": ["schema", "scenario"],
            f"history of {HISTORY}": ["history", "sessions"],
        }
        table([(label, [*ETB, *words]) for label, words in commands.items()], folder, options.runs)


def first_start(folder, processors):
    """Print what a run in an empty cache costs, on so many processors."""
    cold = {**ENVIRONMENT, "NUMBA_CACHE_DIR": str(folder / f"cold-{processors}")}
    on = ["taskset", "--cpu-list", ",".join(map(str, sorted(os.sched_getaffinity(0))[:processors]))]
    wall = time.perf_counter()
    seconds, _ = cost([*on, *ETB, "run", "--out", "first"], folder, cold)
    wall = time.perf_counter() - wall
    print(f"first start, empty cache, processors: {processors}: {wall:.1f} s wall, {seconds:.1f} s processor")


def table(commands, folder, runs):
    """Print processor seconds, their ratio to the peer's in the same round, and memory."""
    for _, words in commands:
        cost(words, folder)
    print(f"{'command':16} {'processor s':>11} {'of peer':>8} {'memory':>9}")
    peers = []
    costs = {label: [] for label, _ in commands}
    for _ in range(runs):
        peers.append(cost(PEER, folder))
        for label, words in commands:
            costs[label].append(cost(words, folder))
    peer = statistics.median(seconds for seconds, _ in peers)
    for label, each in ((PEER[-1], peers), *costs.items()):
        seconds = statistics.median(seconds for seconds, _ in each)
        memory = statistics.median(memory for _, memory in each)
        print(f"{label[:16]:16} {seconds:11.2f} {seconds / peer:8.1f} {memory:6.0f} MB")


def cost(words, folder, environment=ENVIRONMENT):
    """Run a command; return its processor seconds and its greatest memory in MB."""
    piped = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    with subprocess.Popen(words, cwd=folder, env=environment, **piped) as process:
        output = process.stdout.read()
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{' '.join(words)} ended with {process.returncode}:\n{output.decode()}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


if __name__ == "__main__":
    main()
