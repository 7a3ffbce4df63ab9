"""Shows how evenly set-points go out with and without UDS: the same scenario on both benches, side by side.

    python benchmarks/uds_lateness.py [--runs 3] [--wall [--interface udp_multicast --channel 239.74.163.2]]

On the virtual bus the stamps are exact, so that the difference is what UDS does; processor time is that of the process.
With `--wall`, bench and controller are two processes at wall clock on a bus of python-can; the benches take turns.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

import yaml

from etb_hil.base.outcome import BenchOutcome
from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare

BENCHES = ("virtual_classic", "virtual_uds", "virtual_uds_data")


def job_of(bench):
    stock = {"scenario": "friction_check", "model": "default", "limits": "default"}
    return prepare(JobFiles(bench=bench, **{kind: find(kind, name) for kind, name in stock.items()}))


def on_real_bus(bench, folder, interface, channel):
    """Return a stock bench's file with a bus of python-can in place of the virtual one."""
    plain = yaml.safe_load(find("bench", bench).read_text("utf-8"))
    plain["bus"] = {"interface": interface, "channel": channel, "bitrate": "1 Mbit/s"}
    if interface == "udp_multicast":
        plain["bus"]["options"] = {"port": 43000 + os.getpid() % 20_000}
    path = Path(folder) / f"{bench}.yaml"
    path.write_text(yaml.safe_dump(plain, sort_keys=False), "utf-8")
    return path


@contextmanager
def controller_of(job, is_wall):
    """Be the controller on a real bus, in a process of its own."""
    if not is_wall:
        yield
        return
    words = [sys.executable, "-m", "etb_hil", "controller", "--bench", str(job.files.bench)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        process.stdout.readline()
        try:
            yield
        finally:
            process.terminate()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--wall", action="store_true", help="at wall clock, on a bus of python-can")
    parser.add_argument("--interface", default="udp_multicast")
    parser.add_argument("--channel", default="239.74.163.2")
    args = parser.parse_args()
    print("bench            jitter rms     worst  late worst  frame age      run  processor")
    with tempfile.TemporaryDirectory() as folder:
        where = {b: on_real_bus(b, folder, args.interface, args.channel) for b in BENCHES} if args.wall else {}
        jobs = {bench: job_of(where.get(bench, find("bench", bench))) for bench in BENCHES}
        for seed in range(1, args.runs + 1):
            for bench, job in jobs.items():
                begun = time.process_time()
                with controller_of(job, args.wall):
                    results = execute(job, Path(folder), "", seed).results
                spent = time.process_time() - begun
                fared = results.bench
                if fared.outcome is not BenchOutcome.OK:
                    print(f"{bench:16} {fared.outcome} {fared.reason_id}: {fared.reason}")
                    continue
                print(
                    f"{bench:16} {fared.set_point_jitter.rms_us:8.1f} us {fared.set_point_jitter.worst_us:6.0f} us "
                    f"{fared.lateness.worst_ms:8.3f} ms {fared.frame_age.worst_ms:7.3f} ms {results.duration_s:5.1f} s "
                    f"{spent:8.2f} s"
                )


if __name__ == "__main__":
    main()
