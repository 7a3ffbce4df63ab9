"""What two judgements of the same measurement differ in: one value, the first sample, or the verdicts' table."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from etb_hil.base.outcome import ExitCode

if TYPE_CHECKING:
    from collections.abc import Iterator

    from etb_hil.recording.samples import Float64, Int64
    from etb_hil.session.finished import Finished


_ALWAYS = {"run_id", "exit_code", "unit", "bench", "numbers", "exceedances", "phases", "bus"}  # of any version


@dataclass(frozen=True, slots=True)
class Divergence:
    """Where two runs part for the first time: the signal, seconds since the begin of the run, both values."""

    signal: str
    time_s: float
    here: float
    there: float

    def __str__(self) -> str:
        return f"{self.signal} at {self.time_s:.9f} s: {self.here!r} here, {self.there!r} there"


def first_divergence(here: Finished, there: Finished) -> Divergence | None:
    """Return the earliest sample, or estimate at 1 kHz, in which two runs differ, or None; NaN equals NaN."""
    origin = there.record.start_ns
    found = [*_samples(here, there, origin), *_estimates(here, there)]
    return min(found, key=lambda divergence: divergence.time_s, default=None)


def _samples(here: Finished, there: Finished, origin_ns: int) -> Iterator[Divergence]:
    ours, theirs = here.analysis.recording, there.analysis.recording
    for source in dict.fromkeys((*ours.sources, *theirs.sources)):
        if source not in ours.sources or source not in theirs.sources:
            only = ours if source in ours.sources else theirs
            time_s = (int(only.block(source).time_ns[0]) - origin_ns) * 1e-9
            yield Divergence(source, time_s, *((1.0, np.nan) if only is ours else (np.nan, 1.0)))
            continue
        mine, other = ours.block(source), theirs.block(source)
        count = min(len(mine), len(other))
        row = _first(mine.time_ns[:count], other.time_ns[:count])
        if row is None and len(mine) != len(other):
            row = count
        if row is not None:
            times = [float(b.time_ns[row] - origin_ns) * 1e-9 if row < len(b) else np.nan for b in (mine, other)]
            yield Divergence(f"{source}.time", float(np.nanmin(times)), *times)
        for role in sorted(mine.columns.keys() & other.columns.keys()):
            yield from _values(f"{source}.{role}", mine.time_ns, mine.columns[role], other.columns[role], origin_ns)


def _values(signal: str, time_ns: Int64, mine: Float64, other: Float64, origin_ns: int) -> Iterator[Divergence]:
    count = min(len(mine), len(other))
    mine, other = np.ascontiguousarray(mine[:count]), np.ascontiguousarray(other[:count])
    bits = np.where(np.isnan(mine) & np.isnan(other), 0, mine.view(np.int64) ^ other.view(np.int64))
    row = _first(bits, np.zeros_like(bits))
    if row is not None:
        yield Divergence(signal, (int(time_ns[row]) - origin_ns) * 1e-9, float(mine[row]), float(other[row]))


def _estimates(here: Finished, there: Finished) -> Iterator[Divergence]:
    mine, other = here.series, there.series
    time_ns = np.rint(mine["time"] * 1e9).astype(np.int64)
    for name in ("velocity", "friction"):
        yield from _values(name, time_ns, mine[name], other[name], 0)


def _first(mine: Int64, other: Int64) -> int | None:
    differs = mine != other
    row = int(differs.argmax()) if len(differs) else 0
    return row if len(differs) and differs[row] else None


def first_difference(finished: Finished) -> str | None:
    """Return the first key whose value is not the one that the session's `results.json` holds, or None."""
    return _difference(finished.session.read_results(), json.loads(json.dumps(finished.results)), "")


def beside_live(finished: Finished) -> tuple[str | None, int]:
    """Return the first difference from the session's live results, or None, and the exit code that follows.

    Where this version gives other results than it gave live, the frames are not those of then: that is no pass. What
    another version finds may differ.
    """
    code = int(finished.results["exit_code"])
    found = first_difference(finished)
    of_this_version = finished.session.read_results().get("versions") == finished.results["versions"]
    return found, (code or ExitCode.INCONCLUSIVE) if found is not None and of_this_version else code


def _difference(before: object, now: object, key: str) -> str | None:
    if isinstance(before, dict) and isinstance(now, dict):
        # A key at the top that the session does not have is one of a later version, but for those that all have.
        added = [name for name in now if name not in before and (key or name in _ALWAYS)]
        names = [name for name in (*before, *added) if f"{key}{name}" != "versions"]
        pairs = [(f"{key}{name}", before.get(name), now.get(name)) for name in names]
    elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        pairs = [(f"{key}{index}", *pair) for index, pair in enumerate(zip(before, now, strict=True))]
    else:
        return None if before == now or (before != before and now != now) else f"{key}: {before!r} live, {now!r} now"  # noqa: PLR0124 (NaN)
    return next(
        (found for name, a, b in pairs if (found := _difference(a, b, f"{name}." if _nested(a) else name))), None
    )


def _nested(value: object) -> bool:
    return isinstance(value, dict | list)


def changes(before: dict[str, Any], now: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Return what a new judgement changed, from two `results.json`: what, before, now."""
    rows = [
        ("bench outcome", before["bench"]["outcome"], now["bench"]["outcome"]),
        ("verdict", before["unit"]["verdict"], now["unit"]["verdict"]),
        ("reason", before["unit"]["reason_id"], now["unit"]["reason_id"]),
    ]
    old = {number["id"]: number for number in before["numbers"]}
    new = {number["id"]: number for number in now["numbers"]}
    rows += [
        (f"{name} {key}".removesuffix(" value"), old.get(name, {}).get(key), new.get(name, {}).get(key))
        for name in dict.fromkeys((*old, *new))
        for key in ("value", "limit_low", "limit_high", "verdict")
    ]
    rows.append(("exceedances", len(before["exceedances"]), len(now["exceedances"])))
    return [(what, _plain(a), _plain(b)) for what, a, b in rows if a != b]


def _plain(value: object) -> str:
    return "-" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)


def changes_text(rows: list[tuple[str, str, str]]) -> str:
    """Return the table of what changed as plain text."""
    if not rows:
        return "  Nothing changed."
    table = [("", "before", "now"), *rows]
    widths = [max(len(row[column]) for row in table) for column in range(3)]
    return "\n".join(
        "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in table
    )
