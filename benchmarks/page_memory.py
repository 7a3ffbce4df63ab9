"""Memory of the operator page over a shift: of its server and of the browser's tab, unit after unit.

    python benchmarks/page_memory.py [--units 600]

A shift of 9 hours has 600 units where each takes 24 s of test and 30 s of hands. The virtual bench needs 3 s for one:
the time between them is left out. Units are healthy and faulty in turn. The slopes leave out the first fifth, in
which the last 20 units and the history fill up.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from page_by_hand import chromium, order, process_of

LOOKS = 30  # at the memory
PATIENCE_S = 120.0


def resident_kb(pid):
    """Return the resident memory of a process in kB."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith("VmRSS")).split()[1])


def heap_kb(browser):
    """Return the memory of the tab's objects in kB, once what nobody holds is collected."""
    browser.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
    metrics = browser.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
    return next(one["value"] for one in metrics if one["name"] == "JSHeapUsedSize") / 1024


def slope(units, memory):
    """Return kB per unit and its standard error."""
    units, memory = np.array(units, dtype=float), np.array(memory, dtype=float)
    later = units > units[-1] / 5
    (rate, _), covariance = np.polyfit(units[later], memory[later], 1, cov=True)
    return rate, np.sqrt(covariance[0, 0])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--units", type=int, default=600)
    options = parser.parse_args()
    rows = []
    print(f"{'units':>6} {'server / MB':>12} {'tab / MB':>9}", flush=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        words = [sys.executable, "-m", "etb_hil", "page", "--out", str(folder), "--port", "0"]
        with process_of(words) as (address, pid), chromium(address, 1) as browser:
            browser.execute_cdp_cmd("Performance.enable", {})
            port = int(address.rstrip("/").rpartition(":")[2])
            cookie = order(port, "", "")
            order(port, "hold", cookie, operator="benchmark")
            for number in range(1, options.units + 1):
                unit = "faulty" if number % 2 else "default"
                order(port, "start", cookie, serial=f"U-{number}", scenario="friction_check", unit=unit)
                end = time.monotonic() + PATIENCE_S
                while len(list(folder.glob("*/report.html"))) < number:
                    assert time.monotonic() < end, f"unit {number} did not end"
                    time.sleep(0.1)
                time.sleep(1.0)  # the run's process ends behind its report
                if number % max(1, options.units // LOOKS) == 0:
                    rows.append((number, resident_kb(pid), heap_kb(browser)))
                    print(f"{number:6} {rows[-1][1] / 1024:12.1f} {rows[-1][2] / 1024:9.2f}", flush=True)
    units, server, tab = zip(*rows, strict=True)
    for what, memory in (("server", server), ("tab", tab)):
        rate, error = slope(units, memory)
        print(f"{what}: {rate:+.2f} kB a unit, standard error {error:.2f}; {600 * rate / 1024:+.1f} MB a shift")


if __name__ == "__main__":
    main()
