"""What is kept of one log among many: a row of plain values, and its exceedances."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from etb_hil import __version__
from etb_hil.base.outcome import UnitVerdict

if TYPE_CHECKING:
    from collections.abc import Sequence

    from etb_hil.session.finished import Finished

JUDGED, REFUSED, CRASHED = "judged", "refused", "crashed"
_RANKS = [str(v) for v in (UnitVerdict.FAIL, UnitVerdict.PASS, UnitVerdict.INCONCLUSIVE)]  # what a whole log is called
_SUMMED = ("duration_s", "frames", "lost", "crc_failures")

Outcome = dict[str, Any]


def part_of(finished: Finished, origin_ns: int) -> Outcome:
    """Return what is kept of a session, or of one stretch of a log; its times count from `origin_ns`, in seconds."""
    results = finished.results
    unit, messages = results["unit"], results["bus"]["messages"]
    later = (finished.record.start_ns - origin_ns) * 1e-9
    return {
        "verdict": None if unit["verdict"] is None else str(unit["verdict"]),
        **{key: str(unit[key]) for key in ("reason_id", "reason", "serial", "part_number", "revision")},
        "bench_outcome": str(results["bench"]["outcome"]),
        "exit_code": results["exit_code"],
        "start_ns": origin_ns,
        "duration_s": results["duration_s"],
        "deciding_s": later,
        "timestamp_grade": results["timestamp_grade"],
        "frames": sum(message["frames"] for message in messages),
        "lost": sum(message["lost"] or 0 for message in messages),
        "crc_failures": sum(message["crc_failures"] for message in messages),
        "numbers": {n["id"]: [n["value"], n["low"], n["high"]] for n in results["numbers"]},
        "exceedances": [
            {**episode, "start_s": episode["start_s"] + later, "end_s": episode["end_s"] + later}
            for episode in results["exceedances"]
        ],
        "version": __version__,
    }


def outcome_of(parts: Sequence[Outcome], notes: Sequence[str]) -> Outcome:
    """Return the row of a log judged in parts, at least one: the first of those that decide, sums, all exceedances."""
    deciding = min(parts, key=lambda part: _RANKS.index(part["verdict"] or _RANKS[-1]))
    return {
        **deciding,
        **{name: sum(part[name] for part in parts) for name in _SUMMED},
        "status": JUDGED,
        "stretches": len(parts),
        "exceedances": [episode for part in parts for episode in part["exceedances"]],
        "notes": "\n".join(notes),
    }
