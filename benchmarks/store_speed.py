"""How fast a store with a million runs of 30 measurements answers, in SQLite and in PostgreSQL.

    python benchmarks/store_speed.py [--runs 1000000] [--parts 100] [--only SQLite|PostgreSQL] [--keep FOLDER]

Fills both stores by SQL (a server of its own in a temporary folder), then asks, each three times: the history of one
part as `etb.history` gives it, the values of a control chart and the latest runs. Then inserts runs of 30 measurements
as a bench does: one by one, from its file on disk to the commit on disk, and many that waited. The server syncs its
disk. Prints wall time and time of this process; the goals are 1 s, 1 s and 20 ms.
"""

import argparse
import shutil
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from etb_hil.api.past import history
from etb_hil.base.outcome import UnitVerdict
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import Unit
from etb_hil.store.address import STORE, StoreAddress, store_address
from etb_hil.store.connection import connected, require_schema, up_to_date
from etb_hil.store.queue import Queue
from etb_hil.store.reading import read_store
from etb_hil.store.row_values import rows_of
from etb_hil.store.selection import Selection
from etb_hil.store.writing import write_run

sys.path[:0] = [str(Path(__file__).parents[1] / "tests" / "store")]
from made_up_runs import LIMITS, result, session  # noqa: E402 (of the tests)
from postgres_cluster import Cluster  # noqa: E402

MEASURED = ("T_st", "T_c", "return_margin", "temperature", *(f"value_{k:02d}" for k in range(26)))
LIMITED = 3  # of these, from the first on, have a limit
FIRST_S, EACH_S = 1735689600, 60  # 2025-01-01, and a run every minute
DIALECTS = {  # a number between -1 and 1, and a time
    "SQLite": (
        "(random() / 9223372036854775808.0)",
        "strftime('%Y-%m-%dT%H:%M:%f', {}, 'unixepoch')",
        "printf('%0{}d', {})",
    ),
    "PostgreSQL": (
        "(2.0 * random() - 1.0)",
        "to_char(to_timestamp({}) AT TIME ZONE 'UTC', 'YYYY-MM-DD\"T\"HH24:MI:SS.MS')",
        "lpad(({1})::text, {0}, '0')",
    ),
}


def fill(address, runs, parts):
    """Fill a store by statements of its own: every unit is tested twice, values scatter by 3 % about 0.17."""
    random, when, padded = DIALECTS["PostgreSQL" if address.is_server else "SQLite"]
    numbers = f"WITH RECURSIVE n(k) AS (SELECT 0 UNION ALL SELECT k + 1 FROM n WHERE k < {runs - 1})"  # noqa: S608
    part = padded.format(3, f"k % {parts}")
    serial = f"'SN' || {part} || '-' || {padded.format(6, f'k / {2 * parts}')}"
    started = when.format(f"{FIRST_S} + {EACH_S} * k") + " || '+00:00'"
    listed = " UNION ALL ".join(
        f"SELECT '{name}' AS id, {20.0 if name == 'temperature' else 0.0} AS base, "
        f"'{'degC' if name == 'temperature' else 'N·m'}' AS unit, {0.26 if m < LIMITED else 'NULL'} AS most"
        for m, name in enumerate(MEASURED)
    )
    of_runs = (
        f"INSERT INTO runs {numbers} SELECT k + 1, 'run-' || {padded.format(7, 'k')}, 'bench ' || (k % 5), {started}, "  # noqa: S608
        f"'Friction check', {serial}, 'P' || {part}, 'A', 'default', 'ok', '', 'pass', 'within_limits', 0, 18.0 FROM n"
    )
    of_values = (
        f"INSERT INTO measurements SELECT run, id, value, unit, value - 0.01, value + 0.01, NULL, most, NULL FROM "  # noqa: S608
        f"(SELECT runs.id AS run, m.id, base + 0.17 * (1.0 + 0.03 * ({random} + {random} + {random})) AS value, unit, "
        f"cast(most AS double precision) AS most FROM runs CROSS JOIN ({listed}) AS m ORDER BY runs.id, m.id) AS made"
    )
    with connected(address, patient=True) as connection:
        fast = "SET session_replication_role = replica" if address.is_server else "PRAGMA synchronous = OFF"
        for statement in (fast, of_runs, of_values):  # keys are right as made, and what is lost is made again
            connection.execute(statement)
            connection.commit()
        if address.is_server:
            connection.execute("SELECT setval('runs_id_seq', (SELECT max(id) FROM runs))")
            connection.commit()
            connection.autocommit = True
            connection.execute("VACUUM ANALYZE")


def timed(name, goal, ask, times=3):
    wall, processor = [], []
    for k in range(times):
        began, spent = time.perf_counter(), time.process_time()
        found = ask(k)
        wall.append(time.perf_counter() - began)
        processor.append(time.process_time() - spent)
    took = f"{min(wall) * 1e3:.1f} to {max(wall) * 1e3:.1f} ms wall, {min(processor) * 1e3:.1f} ms own processor"
    print(f"  {name:42} {took} (goal {goal * 1e3:.0f} ms); {found}", flush=True)


def ask(address, parts, sessions):
    where = str(address)

    def one_part(k):
        return f"{len(history(where, part=f'P{k % parts:03d}').parts[0].runs)} runs"

    def chart(k):
        asked = Selection(measured=("T_st",), part_number=f"P{k % parts:03d}")
        return f"{len(read_store(address, asked))} values"

    def latest(_):
        return f"{len(read_store(address, Selection(latest=20)))} runs"

    timed("history of one part", 1.0, one_part)
    timed("control chart: a measurement of one part", 1.0, chart)
    timed("the latest 20 runs", 1.0, latest)
    insert(address, Queue(sessions))


def measured(k):
    """Return a run of the first part with 30 measurements, as those in the store have."""
    values = (Measurement(name, "", 0.17 + 1e-4 * k, "N·m", 0.16, 0.18, None, 0.26) for name in MEASURED)
    unit = Unit(UnitVerdict.PASS, "within_limits", serial=f"new {k % 17}", part_number="P000", revision="A")
    return result(k, "bench of the study", measurements=Measurements(values), unit=unit)


def insert(address, queue, count=60):
    """Insert so many runs one by one, to the commit and as a bench does, and as many at once."""
    committed, wall = [], []
    for k in range(count):
        began = time.perf_counter()
        with up_to_date(address) as connection:
            assert write_run(address, connection, rows_of(measured(2 * count + k)), lambda _: LIMITS)
            committed.append((time.perf_counter() - began) * 1e3)
    for k in range(2 * count):
        queue.add(measured(k), session(queue.sessions))
        if k < count:
            began = time.perf_counter()
            told = queue.deliver(address)
            wall.append((time.perf_counter() - began) * 1e3)
            assert told.arrived == 1, told
    for name, took in (("opened, a run inserted and committed", committed), ("a run delivered, and closed", wall)):
        middle, high = np.quantile(took, [0.5, 0.95])
        print(f"  {name:42} {middle:.1f} ms wall, {high:.1f} ms in 95 % (goal 20 ms)", flush=True)
    began = time.perf_counter()
    told = queue.deliver(address)
    took = (time.perf_counter() - began) / count * 1e3
    print(f"  {f'insert of a run, among {count} that waited':42} {took:.1f} ms wall (goal 20 ms)", flush=True)
    assert (told.arrived, told.warnings) == (count, ()), told


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=1_000_000)
    parser.add_argument("--parts", type=int, default=100)
    parser.add_argument("--only", choices=("SQLite", "PostgreSQL"))
    parser.add_argument("--keep", type=Path, help="folder of the SQLite store, filled once and asked again")
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="etb-store-speed-"))

    history_of_nothing = Path(tempfile.mkdtemp(prefix="etb-store-warm-"))
    Queue(history_of_nothing).add(result(0), session(history_of_nothing))
    Queue(history_of_nothing).deliver(StoreAddress(history_of_nothing / STORE))
    history(str(history_of_nothing))  # loads the libraries, and so does this
    import scipy.stats  # noqa: F401, PLC0415

    try:
        if options.only != "PostgreSQL":
            address = StoreAddress((options.keep or folder) / STORE)
            if not address.path.exists():
                require_schema(address)
                began = time.perf_counter()
                fill(address, options.runs, options.parts)
                print(f"filled in {time.perf_counter() - began:.0f} s")
            print(f"SQLite, {options.runs} runs, {address.path.stat().st_size / 1e6:.0f} MB", flush=True)
            ask(address, options.parts, folder / "sessions of SQLite")
        if options.only != "SQLite":
            place = Path(tempfile.mkdtemp(prefix="etb-store-server-"))
            cluster = Cluster(place, "max_wal_size = 8GB\nshared_buffers = 1GB")
            cluster.start()
            try:
                address = store_address(cluster.new_database("lab"))
                require_schema(address)
                fill(address, options.runs, options.parts)
                print(f"PostgreSQL, {options.runs} runs", flush=True)
                ask(address, options.parts, folder / "sessions of PostgreSQL")
            finally:
                cluster.stop()
                shutil.rmtree(place)
    finally:
        shutil.rmtree(folder)
        shutil.rmtree(history_of_nothing)


if __name__ == "__main__":
    main()
