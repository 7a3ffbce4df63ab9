"""Outcome of a run as plain values for the page.

The run's own process makes them.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from etb_hil.report.html_report import REPORT_NAME
from etb_hil.report.verdict import verdict_of

if TYPE_CHECKING:
    from etb_hil.results.run_result import RunResult


def outcome_of(
    results: RunResult, session: Path | None, next_step: str = "", notes: tuple[str, ...] = ()
) -> dict[str, Any]:
    """Return verdict, reason, next step and measurements of a run, in SI.

    `next_step` and `notes` are what a station says.
    """
    verdict = verdict_of(results, next_step)
    is_unit = verdict.tone != "fault" and results.unit.verdict is not None
    return {
        "headline": verdict.headline,
        "tone": verdict.tone,
        "reason_id": results.unit.reason_id if is_unit else results.bench.reason_id,
        "reason": verdict.reason,
        "next_step": verdict.next_step,
        "further": [*verdict.further, *notes],
        "is_safe": results.bench.safe_state,
        "session": "" if session is None else session.name,
        "has_report": session is not None and (session / REPORT_NAME).is_file(),
        "duration_s": results.duration_s,
        "measurements": [
            {
                "id": one.id,
                "name": one.name,
                "unit": one.unit,
                "value": one.value,
                "low": one.low,
                "high": one.high,
                "limit_low": one.limit_low,
                "limit_high": one.limit_high,
                "verdict": None if one.verdict is None else str(one.verdict),
            }
            for one in results.measurements.values()
        ],
        "phases": [asdict(phase) for phase in results.phases],
    }


def refusal(headline: str, reason: str, next_step: str = "") -> dict[str, Any]:
    """Return what came of a run that did not begin, or left no results."""
    return {
        "headline": headline,
        "tone": "unsure" if headline in {"ABORTED", "STOPPED"} else "fault" if headline == "BENCH FAULT" else "refused",
        "reason_id": "",
        "reason": reason,
        "next_step": next_step,
        "further": [],
        "is_safe": None,
        "session": "",
        "has_report": False,
        "duration_s": None,
        "measurements": [],
        "phases": [],
    }
