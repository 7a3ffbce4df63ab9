"""`etb-hil station`: what a station file says, and whether the bench is fit.

The command also says which sessions need not be kept.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from datetime import datetime

    from etb_hil.station.station_file import Retention
    from etb_hil.store.address import StoreAddress

_MB = 1e6
_DAY_S = 86400.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("station", type=Path, metavar="FILE", help="station file")
    parser.add_argument("--out", type=Path, default=Path("sessions"), help="folder of sessions (default: %(default)s)")
    parser.add_argument("--tidy", action="store_true", help="delete the sessions that need not be kept any longer")


def run(options: argparse.Namespace) -> int:
    """Print what the station tests and how it stands.

    Exit code 3 where its bench may not judge units now.
    """
    from datetime import UTC, datetime

    from etb_hil.base.errors import BenchFault
    from etb_hil.base.outcome import ExitCode
    from etb_hil.base.stock import find
    from etb_hil.bench.bench_file import load_bench, load_plugins
    from etb_hil.bench.job import bench_store
    from etb_hil.histories.runs import deciding_runs
    from etb_hil.station.admission import require_fit_bench, stamped_later
    from etb_hil.station.station_file import load_station
    from etb_hil.store.address import store_address
    from etb_hil.store.selection import Selection

    document = load_station(options.station)
    station = document.content
    file = find("bench", station.bench, beside=document.path)
    load_plugins(file)
    setup, now = load_bench(file), datetime.now(UTC)
    bench = setup.bench.name
    store = bench_store(setup, options.out) if station.store is None else store_address(station.store, document.path)
    serials = () if station.golden is None else (station.golden.serial,)
    runs = deciding_runs(options.out, store, Selection(serials=serials))
    print(f"{station.name}, bench {bench}")
    for part in station.parts:
        print(f"part      {part.number} revision {part.revision}, approved by {part.approver}")
        print(f"          serial numbers {part.serial}")
    for entry in station.calibration:
        left = (entry.due - now.date()).days
        print(f"calibrate {entry.of}, certificate {entry.certificate}: until {entry.due} ({left} days)")
    if station.retention is not None:
        _keep(options, station.retention, store, now)
    try:
        require_fit_bench(station, bench, "", runs, now)
    except BenchFault as fault:
        print(f"NOT FIT   {fault}")
        return ExitCode.BENCH_FAULT
    print("fit       the bench may judge units")
    if note := stamped_later(runs, now):
        print(f"note      {note}")
    return ExitCode.DONE


def _keep(options: argparse.Namespace, rules: Retention, store: StoreAddress, now: datetime) -> None:
    from etb_hil.station.retention import expired
    from etb_hil.store.reading import known_runs

    known = known_runs(store) if store.is_server or store.path.is_file() else set[str]()
    found = expired(options.out, rules, known, now)
    size = sum(session.size for session in found) / _MB
    for session in found:
        state, why = "expired", ""
        if options.tidy:
            try:
                shutil.rmtree(session.folder)
                state = "deleted"
            except OSError as error:
                state, why = "kept", f": {error}"
        print(f"{state:9} {session.folder.name}, {session.age / _DAY_S:.0f} days old{why}")
    also = "" if options.tidy or not found else "; --tidy deletes them"
    print(f"sessions  {len(found)} need not be kept any longer ({size:.0f} MB){also}")
