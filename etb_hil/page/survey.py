"""Survey of a bench that a page shows before a run.

It is a process of its own that ends with its answer.

It loads what reads bench and station files, which the page's own process can do without.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from etb_hil.base.errors import BenchFault, InputError
from etb_hil.base.outcome import ExitCode
from etb_hil.base.stock import find, stock_files
from etb_hil.bench.bench_file import load_bench, load_plugins
from etb_hil.bench.job import bench_store
from etb_hil.canio.bus.bus_settings import VIRTUAL
from etb_hil.diagnosis.measurement_registry import measurement_kinds
from etb_hil.diagnosis.phase_use import RunPhase
from etb_hil.histories.runs import deciding_runs
from etb_hil.scenario.phases import phase_kinds, use_of
from etb_hil.scenario.scenario_file import load_scenario
from etb_hil.station.admission import require_fit_bench
from etb_hil.station.station_file import load_station
from etb_hil.store.address import store_address
from etb_hil.store.selection import Selection


def survey(bench: str | None, station: Path | None, sessions: Path) -> dict[str, Any]:
    """Return bench, station with its parts, and what can be chosen.

    InputError where a file is wrong.
    """
    document = None if station is None else load_station(station)
    named = bench or ("virtual_classic" if document is None else document.content.bench)
    path = find("bench", named, beside=station)
    load_plugins(path)
    setup = load_bench(path)
    named_store = None if document is None else document.content.store
    store = bench_store(setup, sessions) if named_store is None else store_address(named_store, station)
    is_virtual = setup.bench.bus.interface == VIRTUAL
    found: dict[str, Any] = {
        "bench": setup.bench.name,
        "is_virtual": is_virtual,
        "units": list(stock_files("model")) if is_virtual else [],
        "station": None,
        "store": str(store),
        "scenarios": [],
        "unfit": "",
        "kinds": _kinds(),
    }
    if document is None:
        for name, file in stock_files("scenario").items():
            scenario = load_scenario(file).content
            found["scenarios"].append({"name": name, "title": scenario.name, "about": scenario.description})
        return found
    content = document.content
    found["station"] = content.name
    found["golden"] = "" if content.golden is None else content.golden.serial
    found["parts"] = [
        {"number": part.number, "revision": part.revision, "serial": part.serial, "scenario": part.scenario}
        for part in content.parts
    ]
    golden = content.golden
    serials, measured = ((), ()) if golden is None else ((golden.serial,), tuple(golden.expect))
    try:
        runs = deciding_runs(sessions, store, Selection(serials=serials, measured=measured))
        require_fit_bench(content, setup.bench.name, "", runs, datetime.now(UTC))
    except (BenchFault, InputError) as fault:
        found["unfit"] = str(fault)
    return found


def _kinds() -> dict[str, dict[str, Any]]:
    """Return what is judged in each kind of phase.

    That is its friction, and the measurements that are taken from it.
    What is taken from the motion of the whole run is no step's: where friction passed a limit, an exceedance says it.
    """
    return {
        kind: {
            "is_watched": RunPhase(0, kind, kind, use_of(kind)).is_watched,
            "measured": [one.id for one in measurement_kinds().values() if kind in one.phases],
        }
        for kind in phase_kinds()
    }


def main() -> int:
    """Print the survey as JSON, or what is wrong with the files."""
    # The answer alone goes to standard output; what plug-ins print goes to standard error, also at their end.
    answer = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    parser = argparse.ArgumentParser()
    parser.add_argument("--bench")
    parser.add_argument("--station", type=Path)
    parser.add_argument("--sessions", type=Path, required=True)
    given = parser.parse_args()
    with answer:
        try:
            json.dump(survey(given.bench, given.station, given.sessions), answer)
        except InputError as error:
            json.dump({"wrong": str(error)}, answer)
            return ExitCode.BAD_INPUT
    return 0


if __name__ == "__main__":
    sys.exit(main())
