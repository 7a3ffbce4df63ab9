"""Hours of running: what grows, and whether the counts add up to the frame.

    python benchmarks/soak.py --hours 24                   # in lock-step, about an hour on one core
    python benchmarks/soak.py --hours 0.33 --bench virtual_fd
    python benchmarks/soak.py --hours 0.34 --bench udp_multicast    # at wall clock, the controller a process of its own

One process runs one scenario after another, session, report files and store included, as a bench does unattended.
"""

import argparse
import gc
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from contextlib import contextmanager, nullcontext
from pathlib import Path

import can
from faults_study import job_of

from etb_hil.bench.job import execute
from etb_hil.results.run_result import Jitter


def resident_mb():
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def frames_in(path):
    with can.BLFReader(path) as reader:
        return sum(1 for message in reader if not message.is_error_frame)


@contextmanager
def controller_of(bench):
    """Start the virtual controller of a real bus as a process of its own."""
    command = [sys.executable, "-m", "etb_hil", "controller", "--bench", bench]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as controller:
        controller.stdout.readline()
        try:
            yield
        finally:
            controller.terminate()
            controller.communicate()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--bench", default="virtual_classic")
    parser.add_argument("--unit", default="default")
    options = parser.parse_args()
    is_virtual = options.bench.startswith("virtual")
    job = job_of(options.bench, options.unit if is_virtual else None)
    simulated, runs, wrong, table, worst_us = 0.0, 0, [], [], 0.0
    ended = Counter()
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as name, nullcontext() if is_virtual else controller_of(options.bench):
        folder = Path(name)
        due = 0.0
        while simulated < options.hours * 3600.0:
            finished = execute(job, folder, "", runs)
            results = finished.results
            simulated += results.duration_s
            runs += 1
            health, messages = finished.record.health, results.bus.messages
            counted = sum(m.frames + m.crc_failures + m.repeated_counters for m in messages)
            logged = frames_in(finished.session.raw_log)
            jitter = results.bench.set_point_jitter or Jitter(0.0, 0.0)
            worst_us = max(worst_us, jitter.worst_us)
            if counted != logged or counted != health["sent"] + health["received"]:
                wrong.append((runs, counted, logged, health["sent"] + health["received"]))
            if results.exit_code:
                ended[results.bench.reason_id or results.unit.reason_id] += 1
            shutil.rmtree(finished.session.folder)  # the disk grows by design
            finished.session.folder.mkdir()  # its name stays taken
            del finished
            if simulated >= due:
                gc.collect()
                row = (
                    simulated / 3600.0,
                    resident_mb(),
                    len(list(Path("/proc/self/fd").iterdir())),
                    threading.active_count(),
                )
                table.append(row)
                late = f"set-points {jitter.rms_us:.0f} us rms, {worst_us:.0f} us at worst since the last line"
                print(f"{row[0]:7.2f} h {row[1]:8.1f} MB {row[2]:4d} files {row[3]:3d} threads, {late}", flush=True)
                worst_us = 0.0
                due += options.hours * 3600.0 / 10.0
    wall = time.perf_counter() - begun
    half = table[len(table) // 2 :]
    growth = (half[-1][1] - half[0][1]) / max(half[-1][0] - half[0][0], 1e-9)
    print(f"{options.bench}: {runs} runs, {simulated / 3600.0:.2f} h in {wall:.0f} s, load {os.getloadavg()[0]:.1f}")
    print(f"growth in the second half: {growth:+.2f} MB an hour; runs that do not add up: {wrong or 'none'}")
    print(f"runs that ended in no pass, by reason: {dict(ended) or 'none'}")
    return bool(wrong) or (is_virtual and bool(ended))  # at wall clock a host that stalls may end a run


if __name__ == "__main__":
    raise SystemExit(main())
