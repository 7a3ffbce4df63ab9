"""Whether a unit may be tested now.

Admission depends on its serial number, on what came of it before, and on whether the bench is fit.

Earlier runs are ordered by their stamps. Where a run is stamped after now, one of the clocks was wrong, and its place
in that order is unknown. It counts neither for a unit or a bench nor against it, and `stamped_later` says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime

from etb_hil.base.errors import BenchFault, InputError, Problem
from etb_hil.base.outcome import BenchOutcome
from etb_hil.station.serial_pattern import LONGEST
from etb_hil.station.station_file import Golden, Part, Station
from etb_hil.store.run import Run


def admitted_part(station: Station, serial: str, runs: Sequence[Run], now: datetime) -> Part:
    """Return the part that a unit is.

    InputError where its number is no part's, or it may not come again.

    `runs` are all earlier ones, in any order.
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
        _refuse_again(station, part, serial, _judged_by(runs, now))
    return part


def _refuse_again(station: Station, part: Part, serial: str, runs: Sequence[Run]) -> None:
    judged = [run for run in runs if (run.serial, run.part_number) == (serial, part.number)]
    if not judged:
        return
    last = judged[-1]
    said = f"{last.verdict} on {_shown(last.at)}"
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


def _judged_by(runs: Sequence[Run], now: datetime) -> list[Run]:
    """Return the runs that judged their unit until now, in order of time."""
    return sorted((run for run in runs if _judged(run) and run.at <= now), key=lambda run: run.at)


def _shown(at: datetime) -> str:
    return f"{at:%Y-%m-%d %H:%M %Z}"


def stamped_later(runs: Sequence[Run], now: datetime) -> str:
    """Return which runs do not count because they are stamped after now.

    The text is empty where there are none.
    """
    later = sorted((run for run in runs if _judged(run) and run.at > now), key=lambda run: run.at)
    if not later:
        return ""
    last = f"{later[-1].run_id} on {_shown(later[-1].at)}"
    what = f"the run {last} is" if len(later) == 1 else f"{len(later)} runs, the last {last}, are"
    counts = "it does not count" if len(later) == 1 else "they do not count"
    return f"{what} stamped after now ({_shown(now)}), so {counts}; set the clocks of the benches right"


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
    of_bench = [run for run in runs if run.serial == golden.serial and run.bench == bench]
    checks, later = _judged_by(of_bench, now), stamped_later(of_bench, now)
    also = f"; {later}" if later else ""
    how = f"test the golden unit, serial number {golden.serial}, first{also}"
    if not checks:
        raise BenchFault(f"the bench has not checked itself with the golden unit yet; {how}")
    last = checks[-1]
    age = (now - last.at).total_seconds()
    if wrong := [text for text, good in compared(golden, last) if not good]:
        raise BenchFault(
            f"the golden unit came out wrong in {last.run_id}: {'; '.join(wrong)}; "
            f"find out why, then test it again{also}"
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
