"""Whether a unit may be tested now.

Admission depends on its serial number, on what came of it before, and on whether the bench is fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime

from etb_hil.base.errors import BenchFault, InputError, Problem
from etb_hil.base.outcome import BenchOutcome
from etb_hil.station.serial_pattern import LONGEST
from etb_hil.station.station_file import Golden, Part, Station
from etb_hil.store.run import Run


def admitted_part(station: Station, serial: str, runs: Sequence[Run]) -> Part:
    """Return the part that a unit is.

    InputError where its number is no part's, or it may not come again.

    `runs` are all earlier ones, in order of time.
    """
    if not serial:
        raise InputError(Problem("this station wants a serial number", remedy="give one with --serial"))
    parts = station.parts_of(serial)
    if not parts and len(serial) > LONGEST:
        what = f"the serial number has {len(serial)} characters"
        raise InputError(Problem(what, allowed=f"{LONGEST} at most", remedy="scan again, one label alone"))
    if not parts:
        patterns = "; ".join(f"{part.number}: {part.serial}" for part in station.parts)
        raise InputError(
            Problem(
                "no part of this station has such a serial number", value=serial, allowed=patterns, remedy="scan again"
            )
        )
    if len(parts) > 1:
        both = "; ".join(f"{part.number}: {part.serial}" for part in parts)
        what = f"the serial number fits several parts ({both})"
        raise InputError(Problem(what, value=serial, remedy="make the patterns of the station file exclude each other"))
    part = parts[0]
    if station.golden is None or serial != station.golden.serial:
        _refuse_again(station, part, serial, runs)
    return part


def _refuse_again(station: Station, part: Part, serial: str, runs: Sequence[Run]) -> None:
    judged = [run for run in runs if _judged(run) and (run.serial, run.part_number) == (serial, part.number)]
    if not judged:
        return
    last = judged[-1]
    said = f"{last.verdict} on {last.started[:16].replace('T', ' ')} UTC"
    if last.verdict not in station.retest.after:
        allowed = ", ".join(station.retest.after) or "never"
        problem = "the unit was judged already"
        raise InputError(
            Problem(
                problem,
                value=f"{serial}: {said}",
                allowed=f"again after: {allowed}",
                remedy="scan again, or set it aside",
            )
        )
    if len(judged) >= station.retest.most:
        raise InputError(
            Problem(
                "the unit was judged as often as it may be",
                value=f"{serial}: {len(judged)} times, at last {said}",
                allowed=f"{station.retest.most} times",
                remedy="set it aside",
            )
        )


def _judged(run: Run) -> bool:
    return run.bench_outcome == BenchOutcome.OK and run.verdict is not None


def require_fit_bench(station: Station, bench: str, serial: str, runs: Sequence[Run], now: datetime) -> None:
    """Raise BenchFault where the bench of this name may not judge units at this time.

    A calibration is overdue, or the golden unit was not measured lately, or came out wrong; the golden unit itself is
    always let in.
    """
    overdue = [entry for entry in station.calibration if now.date() > entry.due]
    if overdue:
        names = "; ".join(f"{entry.of} (certificate {entry.certificate}): {entry.due}" for entry in overdue)
        raise BenchFault(f"calibration is overdue since: {names}; have it calibrated, and note the new date")
    golden = station.golden
    if golden is None or serial == golden.serial:
        return
    checks = [run for run in runs if run.serial == golden.serial and run.bench == bench and _judged(run)]
    how = f"test the golden unit, serial number {golden.serial}, first"
    if not checks:
        raise BenchFault(f"the bench has not checked itself with the golden unit yet; {how}")
    last = checks[-1]
    age = (now - datetime.fromisoformat(last.started)).total_seconds()
    if wrong := [text for text, good in compared(golden, last) if not good]:
        raise BenchFault(
            f"the golden unit came out wrong in {last.run_id}: {'; '.join(wrong)}; find out why, then test it again"
        )
    if age > golden.every:
        allowed = f"{golden.every / 3600.0:g} h"
        raise BenchFault(f"the golden unit was measured {age / 3600.0:.1f} h ago (allowed: {allowed}); {how}")


def compared(golden: Golden, run: Run) -> list[tuple[str, bool]]:
    """Return each number of the golden unit's run beside what is expected of it.

    Each says whether it is as expected.
    """
    found = []
    for name, expected in golden.expect.items():
        measured = run.numbers.get(name)
        said = f"{name} {'unknown' if measured is None else f'{measured.value:.3f} N·m'}"
        good = measured is not None and abs(measured.value - expected.value) <= expected.within
        found.append((f"{said}, expected {expected.value:.3f} within {expected.within:.3f} N·m", good))
    return found
