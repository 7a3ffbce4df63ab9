"""How evenly set-points go out at wall clock without the operator page, with one open page, and with twenty.

    python benchmarks/page_lateness.py [--runs 3] [--pages 1 20]

Bench and controller are two processes on a bus of python-can (UDP multicast on this machine); the page is a third one,
and a headless Chromium shows it. The ways take turns. Printed is by how much the time between two commands is off its
period, over all runs of a way, and its ratio to the way without a page.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from page_by_hand import chromium, order, process_of
from uds_lateness import on_real_bus

import etb_hil as etb
from etb_hil.bench.bench_file import load_bench

ETB = [sys.executable, "-m", "etb_hil"]
PATIENCE_S = 120.0


def run_by_page(bench, folder, pages):
    """Run the friction check by the page's START, with so many open pages."""
    words = [*ETB, "page", "--bench", str(bench), "--out", str(folder), "--port", "0"]
    with process_of(words) as (address, _), chromium(address, pages):
        port = int(address.rstrip("/").rpartition(":")[2])
        cookie = order(port, "", "")
        order(port, "hold", cookie, operator="benchmark")
        order(port, "start", cookie, serial="P-1", scenario="friction_check")
        end = time.monotonic() + PATIENCE_S
        while not list(folder.glob("*/report.html")):
            assert time.monotonic() < end, "the run did not end"
            time.sleep(0.2)


def off_period_us(folder, bench):
    """Return by how much each time between two commands of the run in a folder is off its period, in us."""
    session = next(folder.glob("*/raw.blf")).parent
    recording = etb.read(session)
    period_ns = 1e9 / load_bench(bench).bench.command_rate
    return np.abs(np.diff(recording["command_mode"].time_ns) - period_ns) * 1e-3


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--pages", type=int, nargs="+", default=[1, 20])
    options = parser.parse_args()
    off = {pages: [] for pages in (0, *options.pages)}
    with tempfile.TemporaryDirectory() as name:
        bench = on_real_bus("virtual_classic", name, "udp_multicast", "239.74.163.2")
        for number in range(options.runs):
            for pages, found in off.items():
                folder = Path(name) / f"{number}_{pages}"
                with process_of([*ETB, "controller", "--bench", str(bench)]):
                    if pages:
                        run_by_page(bench, folder, pages)
                    else:
                        words = [*ETB, "run", "friction_check", "--bench", str(bench), "--out", str(folder)]
                        subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
                found.append(off_period_us(folder, bench))
    head = f"{'open pages':>10} {'p50 / us':>9} {'p99 / us':>9} {'ratio':>6} {'worst / us':>10} {'commands':>9}"
    print(f"{head}   load {os.getloadavg()[0]:.1f}")
    alone = np.percentile(np.concatenate(off[0]), 99)
    for pages, found in off.items():
        every = np.concatenate(found)
        half, most = np.percentile(every, [50, 99])
        print(f"{pages:10} {half:9.0f} {most:9.0f} {most / alone:6.2f} {every.max():10.0f} {len(every):9}")


if __name__ == "__main__":
    main()
