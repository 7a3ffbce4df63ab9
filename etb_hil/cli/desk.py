"""The desk of a station: what it does before and after a run of a unit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from etb_hil.base.errors import BenchFault, InputError, Problem
from etb_hil.base.outcome import BenchOutcome, ExitCode
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench, load_plugins
from etb_hil.bench.expected_unit import ExpectedUnit
from etb_hil.bench.job import JobFiles, bench_store
from etb_hil.cli.batch import checked_serial
from etb_hil.histories.runs import deciding_runs, run_of_results
from etb_hil.station.admission import admitted_part, compared, require_fit_bench, stamped_later
from etb_hil.station.station_file import load_station
from etb_hil.store.address import StoreAddress, store_address
from etb_hil.store.selection import Selection

if TYPE_CHECKING:
    import argparse

    from etb_hil.base.yamlfile import Document
    from etb_hil.results.run_result import RunResult
    from etb_hil.station.station_file import Part, Station
    from etb_hil.store.run import Run

STATION_FILE = "station.yaml"


def station_of(options: argparse.Namespace) -> Path | None:
    """Return the station file that is named, or that is beside the bench file."""
    if options.station is not None:
        return Path(options.station)
    beside = Path(options.bench or "").parent / STATION_FILE
    return beside if options.bench and Path(options.bench).is_file() and beside.is_file() else None


class Conclusion(NamedTuple):
    """What a golden unit's run says of the bench.

    The conclusion has results as they are told, lines to be said, and what is to be done.
    """

    results: RunResult
    lines: list[str]
    next_step: str


@dataclass(frozen=True, slots=True)
class Desk:
    """A station file and its sessions.

    `unit` is the model of the virtual unit, on a virtual bench.
    """

    document: Document[Station]
    bench: Path
    bench_name: str
    sessions: Path
    store: StoreAddress
    unit: Path | None

    @staticmethod
    def open(options: argparse.Namespace, path: Path) -> Desk:
        """Read the station file.

        InputError where it is wrong, or another option names what the station decides.
        """
        document = load_station(path)
        given = [name for name in ("scenario", "model", "limits") if getattr(options, name) is not None]
        if given or (options.station is not None and options.bench is not None):
            names = ", ".join(given or ["bench"])
            raise InputError(Problem("the station file decides on this", value=names, remedy="leave it out"))
        bench = find("bench", options.bench or document.content.bench, beside=path)
        load_plugins(bench)
        unit = None if options.unit is None else find("model", options.unit)
        setup = load_bench(bench)
        named = document.content.store
        store = bench_store(setup, options.out) if named is None else store_address(named, path)
        return Desk(document, bench, setup.bench.name, options.out, store, unit)

    def check(self, text: str) -> str:
        """Return a serial number that may be tested; InputError says why not."""
        serial = checked_serial(text)
        admitted_part(self.document.content, serial, self._runs(serial), datetime.now(UTC))
        return serial

    def files(self, serial: str) -> JobFiles:
        """Return the files by which a unit is tested; InputError where it may not be."""
        path = self.document.path
        part: Part = admitted_part(self.document.content, serial, self._runs(serial), datetime.now(UTC))
        return JobFiles(
            scenario=find("scenario", part.scenario, beside=path),
            bench=self.bench,
            model=find("model", part.model, beside=path),
            limits=find("limits", part.limits, beside=path),
            unit=self.unit,
            dbc=None if part.dbc is None else find("dbc", part.dbc, beside=path),
            station=path,
            expected=ExpectedUnit("", part.number, part.software or "", part.clear_trouble_codes),
            store=self.store,
        )

    def require_fit_bench(self, serial: str) -> str:
        """Raise BenchFault where the bench may not judge units now.

        Return what is to be said of the earlier runs where it may, or an empty text.
        """
        runs, now = self._runs(serial), datetime.now(UTC)
        require_fit_bench(self.document.content, self.bench_name, serial, runs, now)
        return stamped_later(runs, now)

    def why_unfit(self) -> str:
        """Return why the bench may not judge units now, or an empty text."""
        try:
            self.require_fit_bench("")
        except BenchFault as fault:
            return str(fault)
        return ""

    def conclusion(self, results: RunResult) -> Conclusion | None:
        """Return what a run of the golden unit means, None of any other.

        The run judges the bench, and not the unit.
        """
        golden = self.document.content.golden
        if golden is None or results.unit.serial != golden.serial:
            return None
        if results.bench.outcome is not BenchOutcome.OK:
            return None
        found = compared(golden, run_of_results(results))
        lines = [f"{'' if good else 'NOT '}as expected: {text}" for text, good in found]
        if all(good for _, good in found):
            lines.append(f"the bench is fit to judge units for {golden.every / 3600.0:g} h")
            told = replace(results, exit_code=int(ExitCode.DONE))
            return Conclusion(told, lines, "Put the golden unit back; the bench is fit to judge units.")
        wrong = "; ".join(text for text, good in found if not good)
        lines.append("the bench is NOT fit to judge units: find out why, then repeat")
        return Conclusion(_as_bench_fault(results, wrong), lines, "")

    def _runs(self, serial: str) -> list[Run]:
        golden = self.document.content.golden
        serials = (serial,) if golden is None else (serial, golden.serial)
        return deciding_runs(self.sessions, self.store, Selection(serials=serials))


def _as_bench_fault(results: RunResult, reason: str) -> RunResult:
    """Return results that blame the bench.

    A golden unit's friction is known, so nothing is said of the unit.
    """
    bench = replace(results.bench, outcome=BenchOutcome.FAULT, reason_id="golden_unit_wrong", reason=reason)
    unit = replace(results.unit, verdict=None, reason_id="run_not_finished", reason="", next_step="", also=())
    return replace(results, bench=bench, unit=unit, exit_code=int(ExitCode.BENCH_FAULT))
