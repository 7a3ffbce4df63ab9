"""From a cause to drive off, by the controller's own log: bench and controller as two processes at wall clock.

    python benchmarks/safe_stop.py --runs 300 --cause SIGINT SIGTERM SIGHUP SIGQUIT SIGKILL
    python benchmarks/safe_stop.py --interface socketcan --channel vcan0 --runs 300 --cause SIGKILL LINK_DOWN LINK_GONE

The bus is UDP multicast on loopback, or any that both can open. The controller lives on from run to run. SIGKILL and
SIGQUIT, and a link of SocketCAN that is set down or deleted while the plate moves, are measured from the last command
on the controller's clock; the others from the signal to drive off, on the clock that both processes share.
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

import etb_hil.bench.job  # what a run loads
from etb_hil.base.stock import find
from etb_hil.cli.main import main as etb_hil

SCENARIO = """schema: etb_hil/scenario/1
name: Sway
phases:
  - {id: sway, kind: ramp, between: [20 deg, 70 deg], speed: 1 rad/s, repeat: 4}
"""


SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGKILL")
START_S = 300.0  # a machine that has to compile everything first takes minutes
FROM_COMMAND = ("SIGKILL", "SIGQUIT", "LINK_DOWN", "LINK_GONE")
LINK = {  # how it is broken, and mended
    "LINK_DOWN": ("link set {} down", "link set {} up"),
    "LINK_GONE": ("link del {}", "link add {} type vcan", "link set {} mtu 72 up"),
}


def ip(words, channel):
    subprocess.run(["ip", *words.format(channel).split()], check=True)


def bench_file(folder, options):
    text = find("bench", "vcan_classic").read_text()
    wanted = f"bus: {{interface: {options.interface}, channel: {options.channel}, bitrate: 1 Mbit/s, fd: true}}"
    lines = [wanted if line.startswith("bus:") else line for line in text.splitlines()]
    path = folder / "bench.yaml"
    path.write_text("\n".join(lines) + "\n")
    (folder / "sway.yaml").write_text(SCENARIO)
    return path


def events(path):
    return [json.loads(line) for line in path.read_text().splitlines() if line.endswith("}")] if path.exists() else []


def wait_for(condition, seconds):
    deadline = time.monotonic() + seconds
    while not (found := condition()):
        if time.monotonic() > deadline:
            raise TimeoutError
        time.sleep(0.02)
    return found


def bench_process(arguments):
    """Start `etb-hil` in a group of its own, forked from this process: it has loaded already what takes seconds."""
    if pid := os.fork():
        return pid
    code = 1
    try:
        os.setpgid(0, 0)
        nowhere = os.open(os.devnull, os.O_RDWR)
        for number in range(3):
            os.dup2(nowhere, number)
        code = etb_hil([str(argument) for argument in arguments])
    finally:
        os._exit(code)


@contextmanager
def controller_process(bench, log):
    """Start the virtual controller, a process of its own; it outlives its benches."""
    command = [sys.executable, "-m", "etb_hil", "controller", "--bench", str(bench), "--log", str(log)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as controller:
        try:
            controller.stdout.readline()
            yield controller
        finally:
            controller.terminate()
            controller.communicate()


def one_run(folder, log, options, cause, rng):
    """Return how long it took, in ms, and how the controller calls the reason."""
    before = len(events(log))
    bench = ("--bench", folder / "bench.yaml", "--out", folder / "out")
    run = bench_process(["run", folder / "sway.yaml", *bench])
    broken = False
    try:
        wait_for(lambda: any(e["event"] == "drive_on" for e in events(log)[before:]), START_S)
        time.sleep(rng.uniform(0.5, 2.0))
        if any(e["event"] == "drive_off" for e in events(log)[before:]):
            raise TimeoutError  # the run ended by itself: the host was too slow for it
        at_ns = time.time_ns()
        if broken := cause in LINK:
            ip(LINK[cause][0], options.channel)
        else:
            os.kill(run, getattr(signal, cause))
        off = wait_for(lambda: [e for e in events(log)[before:] if e["event"] == "drive_off"], 10.0)[-1]
    finally:
        os.kill(run, signal.SIGKILL)  # its report is no part of this
        os.waitpid(run, 0)
        for words in LINK[cause][1:] if broken else ():
            ip(words, options.channel)
    if cause in FROM_COMMAND:
        return off["since_command_ms"], off["reason"]
    return (off["stamp_ns"] - at_ns) * 1e-6, off["reason"]


def runs_of(cause, options, rng):
    """Return the times, the reasons and how many runs did not get as far as the cause; say the state every 50 runs."""
    took, reasons, failed = [], set(), 0
    with tempfile.TemporaryDirectory() as name:
        folder, log = Path(name), Path(name) / "controller.jsonl"
        while len(took) + failed < options.runs:
            with controller_process(bench_file(folder, options), log) as controller:
                while controller.poll() is None and len(took) + failed < options.runs:
                    try:
                        milliseconds, reason = one_run(folder, log, options, cause, rng)
                    except TimeoutError:
                        failed += 1
                        break  # a controller afresh
                    took.append(milliseconds)
                    reasons.add(reason)
                    shutil.rmtree(folder / "out")
                    if len(took) % 50 == 0 and len(took) < options.runs:
                        print(told(cause, took, reasons, failed), flush=True)
    return took, reasons, failed


def told(cause, took, reasons, failed):
    """Return the state of a cause in words."""
    if not took:
        return f"{cause:8} no run got that far"
    return (
        f"{cause:8} {len(took)} runs: median {statistics.median(took):.1f} ms, worst {max(took):.1f} ms; "
        f"reason {', '.join(sorted(reasons))}; {failed} did not get that far; load {os.getloadavg()[0]:.1f}"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=300, help="of each cause")
    parser.add_argument("--cause", nargs="*", default=list(SIGNALS), choices=[*SIGNALS, *LINK])
    parser.add_argument("--interface", default="udp_multicast")
    parser.add_argument("--channel", default="239.74.163.9")
    options = parser.parse_args()
    rng = random.Random(1)  # noqa: S311 (when to stop is no secret)
    for cause in options.cause:
        print(told(cause, *runs_of(cause, options, rng)), flush=True)


if __name__ == "__main__":
    main()
