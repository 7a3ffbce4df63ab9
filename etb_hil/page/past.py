"""What the page shows of earlier runs: the last units, the yield, and a measurement over time; from the store."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

from etb_hil.base.outcome import BenchOutcome
from etb_hil.store.address import STORE

LAST = 20  # units
MOST = 2000  # values of a chart


class Past:
    """Reads the store in a folder of sessions; a store that is not there, or is written to, gives what it can."""

    def __init__(self, sessions: Path) -> None:
        self._sessions = sessions

    def recent(self) -> dict[str, Any]:
        """Return the last `LAST` finished runs, newest first, and of the units among them how many were judged.

        A unit that was run several times counts by its last run that judged it.
        """
        rows = self._rows(
            "SELECT run_id, started, serial, part_number, scenario, bench, bench_outcome, verdict, reason FROM runs "
            "WHERE bench_outcome IS NOT NULL ORDER BY started DESC, run_id DESC LIMIT ?",
            (LAST,),
        )
        names = ("run_id", "started", "serial", "part", "scenario", "bench", "outcome", "verdict", "reason")
        runs = [dict(zip(names, row, strict=True)) for row in rows]
        for run in runs:
            run["has_report"] = (self._sessions / run["run_id"] / "report.html").is_file()
        judged: dict[str, str] = {}
        for run in runs:
            if run["outcome"] == BenchOutcome.OK and run["verdict"] is not None:
                judged.setdefault(run["serial"] or run["run_id"], run["verdict"])
        passed = sum(verdict == "pass" for verdict in judged.values())
        return {"runs": runs, "judged": len(judged), "passed": passed}

    def measured(self) -> list[dict[str, str]]:
        """Return the ids and units of what the last runs measured, those with a limit first."""
        rows = self._rows(
            "SELECT id, unit, max(limit_low IS NOT NULL OR limit_high IS NOT NULL) FROM measurements WHERE run IN "
            "(SELECT id FROM runs WHERE bench_outcome IS NOT NULL ORDER BY started DESC, run_id DESC LIMIT ?) "
            "GROUP BY id ORDER BY 3 DESC, 1",
            (LAST,),
        )
        return [{"id": row[0], "unit": row[1]} for row in rows]

    def history(self, measurement: str) -> list[dict[str, Any]]:
        """Return the last `MOST` values of a measurement, oldest first, with interval, limits and verdict."""
        rows = self._rows(
            "SELECT started, serial, value, low, high, limit_low, limit_high, measurements.verdict, unit "
            "FROM measurements JOIN runs ON runs.id = measurements.run "
            "WHERE measurements.id = ? AND value IS NOT NULL AND bench_outcome IS NOT NULL "
            "ORDER BY started DESC, run_id DESC LIMIT ?",
            (measurement, MOST),
        )
        names = ("started", "serial", "value", "low", "high", "limit_low", "limit_high", "verdict", "unit")
        return [dict(zip(names, row, strict=True)) for row in reversed(rows)]

    def _rows(self, query: str, values: tuple[str | int, ...]) -> list[tuple[Any, ...]]:
        path = self._sessions / STORE
        if not path.is_file():
            return []
        try:
            with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True, timeout=1.0)) as store:
                return store.execute(query, values).fetchall()
        except sqlite3.Error:
            return []
