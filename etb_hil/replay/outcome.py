"""What is kept of one log among many: a row of plain values, and its exceedances."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from etb_hil import __version__
from etb_hil.base.outcome import UnitVerdict

if TYPE_CHECKING:
    from collections.abc import Sequence

    from etb_hil.session.finished import Finished

JUDGED, REFUSED, CRASHED = "judged", "refused", "crashed"
# Why a stretch may say nothing without any doubt in what was measured: it shows too little.
SHOWS_TOO_LITTLE = frozenset({
    "too_little_motion", "too_few_windows", "no_samples", "run_not_finished", "T_c_not_reached", "T_st_undecided",
    "T_st_break_away_undecided", "T_c_undecided", "return_margin_undecided", "one_way",
    "places_not_seen",
})  # fmt: skip
_SUMMED = ("duration_s", "frames", "lost", "crc_failures")

Outcome = dict[str, Any]


def rank(verdict: str | None, reason_id: str) -> int:
    """Return a place among a log's stretches, the lowest decides: fail, doubt in the data, pass, too little to see.

    No pass outvotes a stretch whose sensors or frames contradict each other.
    """
    if verdict == UnitVerdict.FAIL:
        return 0
    if verdict == UnitVerdict.PASS:
        return 2
    return 3 if verdict is None or reason_id in SHOWS_TOO_LITTLE else 1


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
    deciding = min(parts, key=lambda part: rank(part["verdict"], part["reason_id"]))
    return {
        **deciding,
        **{name: sum(part[name] for part in parts) for name in _SUMMED},
        "status": JUDGED,
        "stretches": len(parts),
        "exceedances": [episode for part in parts for episode in part["exceedances"]],
        "notes": "\n".join(notes),
    }
