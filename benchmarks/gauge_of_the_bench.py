"""Gauge R&R of the virtual benches themselves: units of one part, each measured several times on each bench.

    python benchmarks/gauge_of_the_bench.py [--units 8] [--trials 2] [--first 4000] [--out FOLDER]

Units are the stock part with every parameter drawn inside its tolerance; the benches know the stock model. Trials
differ in the noise of the sensors. Prints what `etb-hil history` says of the study; `--out` keeps the sessions.
"""

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.histories.history import histories
from etb_hil.histories.runs import read_runs
from etb_hil.report.history_text import history_text

BENCHES = ("virtual_classic", "virtual_fd")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--units", type=int, default=8)
    parser.add_argument("--trials", type=int, default=2)
    parser.add_argument("--first", type=int, default=4000, help="first seed")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        study(options, options.out or Path(scratch))


def study(options, folder):
    names = ("friction_check", None, "default", "default", "default")
    kinds = ("scenario", "bench", "model", "limits", "model")
    jobs = [
        prepare(JobFiles(*(find(kind, name or bench) for kind, name in zip(kinds, names, strict=True))))
        for bench in BENCHES
    ]
    for number in range(options.units):
        unit = jobs[0].model.drawn(np.random.default_rng([options.first, number]))
        for job in jobs:
            for trial in range(options.trials):
                begun = time.process_time()
                finished = execute(replace(job, unit=unit), folder, f"U{number:02d}", options.first + trial)
                took = time.process_time() - begun
                verdict = finished.results.unit.verdict
                print(f"U{number:02d} {job.setup.bench.name} {trial}: {verdict}, {took:.1f} s", flush=True)
    (found,) = histories(read_runs([folder])[0])
    print(history_text(found, 4))


if __name__ == "__main__":
    main()
