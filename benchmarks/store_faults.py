"""Whether each run arrives once: two benches store 100 runs each while their PostgreSQL server fails in every way.

    python benchmarks/store_faults.py [--only NAME]

A server of its own in a temporary folder for each fault, the disk of one a file system of 100 MB (needs root). Prints
how many runs arrived, how many twice, after how many some waited on disk, and the slowest delivery of a run. The exit
code is 1 where a run is missing or doubled.
"""

import argparse
import itertools
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

from etb_hil.store.address import store_address
from etb_hil.store.queue import Queue
from etb_hil.store.reading import read_store

sys.path[:0] = [str(Path(__file__).parents[1] / "tests" / "store")]
from postgres_cluster import Cluster  # noqa: E402 (of the tests)
from server_faults import RUNS, Proxy, ended, fill, two_benches  # noqa: E402

TIMES = 3  # that the fault comes
EACH_S = 1.0  # from one to the next
DOWN_S = 0.5


def stopped(server, _):
    server.stop()
    time.sleep(DOWN_S)
    server.start()


def killed(server, _):
    server.kill()
    time.sleep(DOWN_S)
    server.start()


def restarted(server, _):
    server.control("restart", "-m", "fast")


def disk_full(server, place):
    fill(place / "filler")
    time.sleep(DOWN_S)
    (place / "filler").unlink()
    with suppress(AssertionError):  # it may have ended, or be starting again by itself
        server.control("restart", "-m", "immediate")


def nothing(_, __):
    """Leave the server alone."""


FAULTS = {
    "none": nothing,
    "server stopped": stopped,
    "server killed": killed,
    "server restarted": restarted,
    "disk of the server full": disk_full,
    "connections cut": nothing,  # by a proxy
}


def cuts(seed=1):
    """Yield after how many bytes a connection is cut: two of three somewhere on the way, the third never."""
    chance = random.Random(seed)  # noqa: S311 (no secret)
    for k in itertools.count():
        yield 10**9 if k % 3 == 2 else chance.randrange(20, 9000)


def outcome(name, place, sessions):
    server = Cluster(place)
    server.start()
    try:
        url = server.new_database("lab")
        direct = store_address(url)
        seen = direct
        if name == "connections cut":
            seen = store_address(url.replace(f":{server.port}/", f":{Proxy(server.port, cuts()).port}/"))
        folders = [sessions / bench for bench in ("one", "two")]
        benches = two_benches(folders, seen)
        for _ in range(TIMES):
            time.sleep(EACH_S)
            FAULTS[name](server, place)
        told = ended(benches)
        left = [Queue(folder).deliver(direct) for folder in folders]
        assert all(one.waiting == 0 for one in left), left
        arrived = Counter((run.bench, run.run_id) for run in read_store(direct))
    finally:
        with suppress(AssertionError):
            server.stop()
    expected = {(folder.name, f"run-{k:04d}") for folder in folders for k in range(RUNS)}
    twice = sum(count > 1 for count in arrived.values())
    waited, slowest = sum(one["waited"] for one in told), max(one["slowest_s"] for one in told)
    print(
        f"| {name} | {len(expected & arrived.keys())} of {len(expected)} | {twice} | {waited} | {slowest:.1f} s |",
        flush=True,
    )
    return arrived.keys() == expected and not twice


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=FAULTS)
    options = parser.parse_args()
    for line in ("| fault, three times | runs that arrived | twice | some waited after | slowest |", "|---" * 5 + "|"):
        print(line, flush=True)
    right = True
    for name in [options.only] if options.only else FAULTS:
        place, sessions = (Path(tempfile.mkdtemp(prefix=f"etb-{what}-")) for what in ("faults", "sessions"))
        is_small = name == "disk of the server full"
        try:
            if is_small:
                subprocess.run(["mount", "-t", "tmpfs", "-o", "size=100m", "none", str(place)], check=True)
            right &= outcome(name, place, sessions)
        finally:
            if is_small:
                subprocess.run(["umount", "-l", str(place)], check=False)
            for folder in (place, sessions):
                shutil.rmtree(folder, ignore_errors=True)
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
