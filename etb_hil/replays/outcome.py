"""What is kept of one log among many: a row of plain values, and its exceedances."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

from etb_hil import __version__
from etb_hil.base.outcome import UnitVerdict
from etb_hil.diagnosis.measurement_registry import measurement_kinds

if TYPE_CHECKING:
    from collections.abc import Sequence

    from etb_hil.session.finished import Finished

JUDGED, REFUSED, CRASHED = "judged", "refused", "crashed"
# Why a stretch may say nothing without any doubt in what was measured: it shows too little.
SHOWS_TOO_LITTLE = frozenset({
    "too_little_motion", "too_few_windows", "no_samples", "run_not_finished", "T_c_not_reached", "one_way",
    "places_not_seen", "limits_not_judged",
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
    return 3 if verdict is None or _shows_too_little(reason_id) else 1


def _shows_too_little(reason_id: str) -> bool:
    """Return whether a reason is that of a stretch that shows too little, or of a value too close to its limit."""
    of = reason_id
    for ending in ("_undecided", "_not_measured", "_without_signal"):
        of = of.removesuffix(ending)
    return reason_id in SHOWS_TOO_LITTLE or of in measurement_kinds()


def part_of(finished: Finished, origin_ns: int) -> Outcome:
    """Return what is kept of a session, or of one stretch of a log; its times count from `origin_ns`, in seconds."""
    results = finished.results
    unit, messages = results.unit, results.bus.messages
    later = (finished.record.start_ns - origin_ns) * 1e-9
    return {
        "verdict": None if unit.verdict is None else str(unit.verdict),
        **{key: getattr(unit, key) for key in ("reason_id", "reason", "serial", "part_number", "revision")},
        "bench_outcome": str(results.bench.outcome),
        "exit_code": results.exit_code,
        "start_ns": origin_ns,
        "duration_s": results.duration_s,
        "deciding_s": later,
        "timestamp_grade": results.timestamp_grade,
        "frames": sum(message.frames for message in messages),
        "lost": sum(message.lost or 0 for message in messages),
        "crc_failures": sum(message.crc_failures for message in messages),
        "measurements": {one.id: [one.value, one.low, one.high] for one in results.measurements.values()},
        "exceedances": [
            asdict(replace(episode, start_s=episode.start_s + later, end_s=episode.end_s + later))
            for episode in results.exceedances
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
