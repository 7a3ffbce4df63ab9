"""Earlier runs on the page, read as `history` does.

Last units, yield, and a measurement over time.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from etb_hil.base.errors import InputError
from etb_hil.base.outcome import BenchOutcome
from etb_hil.diagnosis.measurement_registry import name_of
from etb_hil.histories.runs import runs_at
from etb_hil.page.session_files import EXPLANATION
from etb_hil.report.html_report import REPORT_NAME
from etb_hil.results.explanation_file import EXPLANATION_PAGE
from etb_hil.store.address import StoreAddress
from etb_hil.store.run import Measured, Run
from etb_hil.store.selection import Selection

LAST = 20  # units
MOST = 2000  # values of a chart


@dataclass(frozen=True, slots=True)
class Past:
    """Read the runs of a bench from its store, with those that wait for it.

    A store that is down gives what it can.
    """

    sessions: Path
    store: StoreAddress
    bench: str
    golden: str = ""  # the serial number of the station's golden unit, which checks the bench

    def recent(self) -> dict[str, Any]:
        """Return the last `LAST` finished runs, newest first, and their yield.

        The yield is how many of the units were judged, and how.

        A unit that was run several times counts by its last run that judged it. The golden unit does not count.
        """
        runs = [self._shown(run) for run in self._latest(LAST, measured=())]
        judged: dict[str, str] = {}
        for run in runs:
            is_golden = bool(self.golden) and run["serial"] == self.golden
            if run["outcome"] == BenchOutcome.OK and run["verdict"] is not None and not is_golden:
                judged.setdefault(run["serial"] or run["run_id"], run["verdict"])
        passed = sum(verdict == "pass" for verdict in judged.values())
        return {"runs": runs, "judged": len(judged), "passed": passed}

    def measured(self) -> list[dict[str, str]]:
        """Return id, name and unit of what the last runs measured.

        What has a limit comes first.
        """
        units: dict[str, tuple[bool, str]] = {}
        for run in self._latest(LAST):
            for name, one in run.numbers.items():
                units[name] = (one.has_limit or units.get(name, (False, ""))[0], one.unit)
        ordered = sorted(units.items(), key=lambda item: (not item[1][0], item[0]))
        return [{"id": name, "name": name_of(name), "unit": unit} for name, (_, unit) in ordered]

    def history(self, measurement: str) -> list[dict[str, Any]]:
        """Return the last `MOST` values of a measurement, oldest first.

        Each has its interval and its limits.
        """
        runs = reversed(self._latest(MOST, measured=(measurement,)))
        return [_value(run, run.numbers[measurement]) for run in runs if measurement in run.numbers]

    def _shown(self, run: Run) -> dict[str, Any]:
        folder = self.sessions / run.run_id
        return {
            "run_id": run.run_id,
            "started": run.started,
            "serial": run.serial,
            "outcome": run.bench_outcome,
            "verdict": run.verdict,
            "has_session": folder.is_dir(),
            "has_report": (folder / REPORT_NAME).is_file(),
            "is_explained": (folder / EXPLANATION / EXPLANATION_PAGE).is_file(),
        }

    def _latest(self, most: int, measured: tuple[str, ...] | None = None) -> list[Run]:
        """Return the latest finished runs of the bench, newest first."""
        try:
            runs = runs_at(self.sessions, self.store, Selection(bench=self.bench, latest=most, measured=measured))
        except InputError:
            return []
        return runs[: -most - 1 : -1]


def _value(run: Run, one: Measured) -> dict[str, Any]:
    is_outside = (one.limit_low is not None and one.value < one.limit_low) or (
        one.limit_high is not None and one.value > one.limit_high
    )
    return {
        "started": run.started,
        "serial": run.serial,
        "value": one.value,
        "low": one.low,
        "high": one.high,
        "limit_low": one.limit_low,
        "limit_high": one.limit_high,
        "unit": one.unit,
        "is_outside": is_outside,
    }
