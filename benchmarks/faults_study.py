"""Verdicts under faults: each fault alone, and in pairs, at random times; a wrong verdict is listed with its seed.

    python benchmarks/faults_study.py --runs 20                  # each fault alone, on both units
    python benchmarks/faults_study.py --pairs 3                  # each pair of faults
    python benchmarks/faults_study.py --only "sensor jumps" --first 7 --runs 1 -v

Right is: pass of the healthy unit, fail of the faulty one, inconclusive, bench fault. Wrong is: a healthy unit failed,
a faulty one passed, or an end that is no verdict at all.
"""

import argparse
import itertools
import tempfile
import traceback
import zlib
from collections import Counter
from pathlib import Path

import numpy as np
from faults_cases import CASES

from etb_hil.base.stock import find
from etb_hil.bench import job as job_room
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.canio.bus.link import VirtualLink
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.controller.virtual_controller import VirtualController

EXPECTED = {"default": "pass", "faulty": "fail"}


def job_of(bench, unit, scenario="friction_check"):
    kinds = {"scenario": scenario, "bench": bench, "model": "default", "limits": "default"}
    files = {kind: find(kind, name) for kind, name in kinds.items()}
    return prepare(JobFiles(**files, unit=unit and find("model", unit)))


def spoilt_connect(injected):
    """Return what opens the virtual bench with these faults in it."""

    def connect(job, seed):
        bus, dialect = job.setup.bench.bus, job.setup.dialect
        faults = [fault for each in injected for fault in each.bus]
        network = VirtualNetwork(int(bus.bitrate), int(bus.data_bitrate), fd=bus.fd, faults=faults)

        def make(start_ns):
            return VirtualController(job.unit, dialect, seed, nominal=job.model, start_ns=start_ns)

        makers = [each.make for each in injected if each.make is not None]
        node = makers[0](make, dialect) if makers else make(0)
        for spoil in (spoil for each in injected for spoil in each.spoil):
            node = spoil(node)
        for other in (other for each in injected for other in each.nodes):
            network.attach(other, answers=False)
        network.attach(node)
        link = VirtualLink(network)
        for wrap in (wrap for each in injected for wrap in each.link):
            link = wrap(link)
        return link, network.clock

    return connect


def seed_of(*parts):
    return zlib.crc32(repr(parts).encode())


def run_with(job, folder, seed, injected):
    """Run a job with faults; return the finished run."""
    kept = job_room.connect
    job_room.connect = spoilt_connect(injected)
    try:
        return execute(job, Path(folder), "", seed)
    finally:
        job_room.connect = kept


def judge(job, unit, seed, names):
    """Return one run's class, and what it said."""
    rng = np.random.default_rng(seed)
    injected = [CASES[name](rng, job.setup.dialect) for name in names]
    note = "; ".join(each.note for each in injected)
    with tempfile.TemporaryDirectory() as folder:
        try:
            results = run_with(job, folder, seed % 1000, injected).results
        except Exception:  # noqa: BLE001 (any end without a verdict is what the study looks for)
            return "CRASH", f"{note}: {traceback.format_exc(limit=-3)}"
    verdict, bench = results.unit.verdict, results.bench
    if verdict is None:
        return "fault", f"{note}: {bench.reason_id}: {bench.reason}"
    said = f"{note}: {verdict}, {results.unit.reason_id} {results.unit.also}: {results.unit.reason}"
    if verdict == "inconclusive":
        return "unsure", said
    return ("right" if verdict == EXPECTED[unit] else "WRONG"), said


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=0, help="of each fault alone, on each unit")
    parser.add_argument("--pairs", type=int, default=0, help="runs of each pair of faults, units in turn")
    parser.add_argument("--first", type=int, default=0, help="number of the first run")
    parser.add_argument("--only", nargs="*", default=list(CASES), choices=CASES)
    parser.add_argument("--bench", nargs="*", default=["virtual_classic", "virtual_fd"], help="taken in turn")
    parser.add_argument("-v", action="store_true", help="say what every run said")
    options = parser.parse_args()
    jobs = {(bench, unit): job_of(bench, unit) for bench in options.bench for unit in EXPECTED}
    work = []
    for name in options.only:
        work += [((name,), unit, n) for unit in EXPECTED for n in range(options.first, options.first + options.runs)]
    for pair in itertools.combinations(options.only, 2):
        units = itertools.cycle(EXPECTED)
        work += [(pair, next(units), n) for n in range(options.first, options.first + options.pairs)]
    table, bad = {}, []
    for number, (names, unit, n) in enumerate(work, start=1):
        bench = options.bench[n % len(options.bench)]
        kind, said = judge(jobs[bench, unit], unit, seed_of(names, n, unit), names)
        key = names if len(names) == 1 else ("pairs",)
        table.setdefault(key, Counter())[kind] += 1
        line = f"{kind:6} {' + '.join(names)} [{bench} {unit} {n}] {said}"
        if options.v or kind in ("WRONG", "CRASH"):
            print(line, flush=True)
        if kind in ("WRONG", "CRASH"):
            bad.append(line)
        if number % 50 == 0:
            print(f"{number} of {len(work)} runs, {len(bad)} wrong", flush=True)
    print(f"{'fault':28}{'right':>7}{'unsure':>8}{'fault':>7}{'WRONG':>7}{'CRASH':>7}")
    for key, counts in table.items():
        print(
            f"{' + '.join(key):28}"
            + "".join(
                f"{counts[c]:{w}d}"
                for c, w in zip(("right", "unsure", "fault", "WRONG", "CRASH"), (7, 8, 7, 7, 7), strict=True)
            )
        )
    print(f"{len(work)} runs, {len(bad)} wrong")
    return bool(bad)


if __name__ == "__main__":
    raise SystemExit(main())
