"""Trust in a run's samples: facts on the bus and on time.

What a driver or a controller does not tell is unknown, never a constant.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.report import show
from etb_hil.results import shown

if TYPE_CHECKING:
    from etb_hil.results.run_result import Reading, RunResult

TIMESTAMP_GRADES = {
    "sample counter": "exact to the controller's own clock",
    "receive stamps": "late by the bus and the computer",
    "time column of a table": "as it was written",
}


def bus_facts(results: RunResult) -> list[tuple[str, str]]:
    """Return how the bus fared, each fact with its name."""
    bus = results.bus
    facts = [
        (bus.name or "Bus", bus.state or shown.UNKNOWN_WORD),
        ("Load", f"{_share(bus.load)} in the last 0.1 s, {_share(bus.load_peak)} in the worst"),
        ("Error frames", _count(bus.error_frames)),
        ("Error counters", f"transmit {_count(bus.transmit_errors)}, receive {_count(bus.receive_errors)}"),
        ("Dropped by the computer", _count(bus.dropped)),
    ]
    if results.bench.not_watched:
        facts.append(("Not watched", "; ".join(results.bench.not_watched)))
    return facts


def timing_facts(results: RunResult) -> list[tuple[str, str]]:
    """Return how good the time of the samples is, each fact with its name.

    The result says how late whom was, too.
    """
    grade, clock, bench = results.timestamp_grade, results.clock, results.bench
    meaning = TIMESTAMP_GRADES.get(grade, "")
    facts = [("Timestamps", ": ".join(filter(None, (grade or "grade unknown", meaning))))]
    if clock.drift_ppm is not None and clock.residual_rms_us is not None and clock.residual_worst_us is not None:
        scatter = f"scatter {clock.residual_rms_us:.0f} us rms, {clock.residual_worst_us:.0f} us at most"
        facts.append(("Computer against controller", f"drift {clock.drift_ppm:.2f} ppm, {scatter}"))
    late, age, answer, jitter = bench.lateness, bench.frame_age, bench.answer_time, bench.set_point_jitter
    if late is not None:
        facts.append(("Computer late by", f"{late.mean_ms:.2f} ms on average, {late.worst_ms:.2f} ms at most"))
    shown = "unknown" if age is None else f"{age.mean_ms:.2f} ms on average, {age.worst_ms:.2f} ms at most"
    facts.append(("Age of the newest sample", shown))
    shown = "unknown" if answer is None else f"{answer.mean_ms:.1f} ms on average, {answer.worst_ms:.1f} ms at most"
    facts.append(("From command to status", shown))
    shown = "unknown" if jitter is None else f"{jitter.rms_us:.0f} us rms, {jitter.worst_us:.0f} us at most"
    facts.append(("Set-points on the bus, jitter", shown))
    return [*facts, *(_read(one) for one in bench.readings)]


def _read(one: Reading) -> tuple[str, str]:
    name = f"{one.role.replace('_', ' ').capitalize()} (DID {one.identifier:#06x})"
    if one.rate_hz is None or one.gap_worst_ms is None:
        return name, f"{one.count} readings"
    text = f"{one.rate_hz:.3g} a second, {one.gap_worst_ms:.0f} ms apart at most"
    return name, text if one.time_error_worst_ms is None else f"{text}, time known to {one.time_error_worst_ms:.1f} ms"


def _share(load: float | None) -> str:
    return shown.UNKNOWN_WORD if load is None else show.share(load)


def _count(number: int | None) -> str:
    return shown.UNKNOWN_WORD if number is None else str(number)
