"""From a cause to drive off, by the controller's own log: bench and controller as two processes at wall clock.

    python benchmarks/safe_stop.py --runs 300       # every cause but those of SocketCAN
    python benchmarks/safe_stop.py --interface socketcan --channel vcan0 --runs 20 --cause LINK_DOWN LINK_GONE

The bus is UDP multicast on loopback, or any that both can open. The controller lives on from run to run. SIGKILL and
SIGQUIT, and a link of SocketCAN that is set down or deleted while the plate moves, are measured from the last command
on the controller's clock; the others from the cause (a signal sent, the terminal closed, an exception raised in a room
of the bench, the first write that the disk refused) to drive off, on the clock that both processes share.
"""

import argparse
import json
import os
import random
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

from safe_stop_causes import LEFT, LINKS, SURVIVED, cause_of

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare

SCENARIO = """schema: etb_hil/scenario/1
name: Sway
phases:
  - {id: sway, kind: ramp, between: [20 deg, 70 deg], speed: 1 rad/s, repeat: 4}
"""
START_S = 300.0  # a machine that has to compile everything first takes minutes
OFF_S = 10.0


class NotSoFar(Exception):
    """The run ended, or never began to move, before the cause could strike."""


def bench_file(folder, options):
    text = find("bench", "vcan_classic").read_text()
    wanted = f"bus: {{interface: {options.interface}, channel: {options.channel}, bitrate: 1 Mbit/s, fd: true}}"
    lines = [wanted if line.startswith("bus:") else line for line in text.splitlines()]
    path = folder / "bench.yaml"
    path.write_text("\n".join(lines) + "\n")
    (folder / "sway.yaml").write_text(SCENARIO)
    return path


def switches(path, kind):
    """Return the controller's notes of this kind."""
    lines = path.read_text().splitlines() if path.exists() else []
    return [entry for entry in (json.loads(line) for line in lines if line.endswith("}")) if entry["event"] == kind]


def wait_for(condition, seconds, *, run=None, look=lambda: None):
    """Return what the condition returns once that is true; NotSoFar after a time, or where the run has ended."""
    deadline = time.monotonic() + seconds
    while not (found := condition()):
        has_ended = run is not None and os.waitid(os.P_PID, run, os.WEXITED | os.WNOHANG | os.WNOWAIT)
        if has_ended or time.monotonic() > deadline:
            raise NotSoFar
        look()
        time.sleep(0.02)
    return found


def load_kernels():
    """Have this process, and what is forked from it, load what runs are made of: that takes seconds each time."""
    stock = {kind: find(kind, name) for kind, name in (("model", "default"), ("limits", "default"))}
    with tempfile.TemporaryDirectory() as place:
        (Path(place) / "sway.yaml").write_text(SCENARIO)
        files = JobFiles(scenario=Path(place) / "sway.yaml", bench=find("bench", "virtual_classic"), **stock)
        execute(prepare(files), Path(place), "", 1)


@contextmanager
def controller_process(bench, log):
    """Start the virtual controller, a process of its own; it outlives its benches."""
    command = [sys.executable, "-m", "etb_hil", "controller", "--bench", str(bench), "--log", str(log)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as controller:
        try:
            controller.stdout.readline()
            yield controller
        finally:
            controller.terminate()
            controller.communicate()


def one_run(folder, log, cause, rng):
    """Return how long it took, in ms, and how the controller calls the reason."""
    on, off = len(switches(log, "drive_on")), len(switches(log, "drive_off"))
    run = cause.start(["run", folder / "sway.yaml", "--bench", folder / "bench.yaml", "--out", folder / "out"])
    try:
        wait_for(lambda: switches(log, "drive_on")[on:], START_S, run=run, look=cause.look)
        strike_at = time.monotonic() + rng.uniform(0.5, 2.0)
        wait_for(lambda: time.monotonic() > strike_at, START_S, look=cause.look)
        if switches(log, "drive_off")[off:]:
            raise NotSoFar  # the host was too slow for it
        at_ns = cause.strike(run)
        end = wait_for(lambda: switches(log, "drive_off")[off:], OFF_S)[-1]
    finally:
        os.killpg(run, signal.SIGKILL)  # its report is no part of this
        os.waitpid(run, 0)
        cause.mend()
    if cause.from_command:
        return end["since_command_ms"], end["reason"]
    struck_ns = cause.struck_ns(at_ns)
    if not struck_ns:
        raise NotSoFar  # the run ended before
    return (end["stamp_ns"] - struck_ns) * 1e-6, end["reason"]


class Count:
    """What came of a cause's runs."""

    def __init__(self):
        self.took, self.reasons, self.failed = [], set(), 0

    def __len__(self):
        return len(self.took) + self.failed

    def told(self, name):
        """Return the state in words."""
        if not self.took:
            return f"{name:9} no run got that far"
        return (
            f"{name:9} {len(self.took)} runs: median {statistics.median(self.took):.1f} ms, "
            f"worst {max(self.took):.1f} ms; reason {', '.join(sorted(self.reasons))}; "
            f"{self.failed} did not get that far; load {os.getloadavg()[0]:.1f}"
        )


def runs_of(name, options, rng):
    """Return the count of a cause's runs; say the state every 50."""
    count, cause = Count(), cause_of(name, options.channel)
    with tempfile.TemporaryDirectory() as place:
        folder, log = Path(place), Path(place) / "controller.jsonl"
        while len(count) < options.runs:
            with controller_process(bench_file(folder, options), log) as controller:
                while controller.poll() is None and len(count) < options.runs:
                    try:
                        milliseconds, reason = one_run(folder, log, cause, rng)
                        count.took.append(milliseconds)
                        count.reasons.add(reason)
                    except NotSoFar:
                        count.failed += 1
                        break  # a controller afresh
                    finally:
                        shutil.rmtree(folder / "out", ignore_errors=True)
                    if len(count) % 50 == 0 and len(count) < options.runs:
                        print(count.told(name), flush=True)
                    if cause.ends_controller:
                        controller.wait(OFF_S)
    return count


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=300, help="of each cause")
    parser.add_argument("--cause", nargs="*", default=[*SURVIVED, *LEFT], choices=[*SURVIVED, *LEFT, *LINKS])
    parser.add_argument("--interface", default="udp_multicast")
    parser.add_argument("--channel", default="239.74.163.9")
    options = parser.parse_args()
    rng = random.Random(1)  # noqa: S311 (when to stop is no secret)
    load_kernels()
    survived = []
    for name in options.cause:
        count = runs_of(name, options, rng)
        print(count.told(name), flush=True)
        if name in SURVIVED:
            survived += count.took
    if survived:
        middle, worst = statistics.median(survived), max(survived)
        print(
            f"causes that the bench lives through: {len(survived)} runs: median {middle:.1f} ms, worst {worst:.1f} ms"
        )


if __name__ == "__main__":
    main()
