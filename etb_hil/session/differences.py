"""Differences between two judgements of the same measurement.

These are one value, the first sample, or the table of verdicts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.errors import InputError, shortened
from etb_hil.base.outcome import ExitCode
from etb_hil.results import shown
from etb_hil.results.json_file import result_as_dict
from etb_hil.session.dependencies import made_by

if TYPE_CHECKING:
    from collections.abc import Iterator

    from etb_hil.recording.samples import Float64, Int64
    from etb_hil.results.run_result import RunResult
    from etb_hil.session.finished import Finished

_COMPARED = {"value": "", "limit_low": ", lower limit", "limit_high": ", upper limit", "verdict": ", verdict"}


@dataclass(frozen=True, slots=True)
class Divergence:
    """Where two runs part for the first time.

    The place has the signal, the seconds since the begin of the run, and both values.
    """

    signal: str
    time_s: float
    here: float
    there: float

    def __str__(self) -> str:
        return f"{self.signal} at {self.time_s:.9f} s: {self.here!r} here, {self.there!r} there"


def first_divergence(here: Finished, there: Finished) -> Divergence | None:
    """Return the earliest sample in which two runs differ, or None.

    Estimates at 1 kHz count as well; NaN equals NaN.
    """
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
        index = _first(mine.time_ns[:count], other.time_ns[:count])
        if index is None and len(mine) != len(other):
            index = count
        if index is not None:
            times = [float(b.time_ns[index] - origin_ns) * 1e-9 if index < len(b) else np.nan for b in (mine, other)]
            yield Divergence(f"{source}.time", float(np.nanmin(times)), *times)
        for role in sorted(mine.columns.keys() & other.columns.keys()):
            yield from _values(f"{source}.{role}", mine.time_ns, mine.columns[role], other.columns[role], origin_ns)


def _values(signal: str, time_ns: Int64, mine: Float64, other: Float64, origin_ns: int) -> Iterator[Divergence]:
    count = min(len(mine), len(other))
    mine, other = np.ascontiguousarray(mine[:count]), np.ascontiguousarray(other[:count])
    bits = np.where(np.isnan(mine) & np.isnan(other), 0, mine.view(np.int64) ^ other.view(np.int64))
    index = _first(bits, np.zeros_like(bits))
    if index is not None:
        yield Divergence(signal, (int(time_ns[index]) - origin_ns) * 1e-9, float(mine[index]), float(other[index]))


def _estimates(here: Finished, there: Finished) -> Iterator[Divergence]:
    mine, other = here.series, there.series
    time_ns = np.rint(mine["time"] * 1e9).astype(np.int64)
    for name in ("velocity", "friction"):
        yield from _values(name, time_ns, mine[name], other[name], 0)


def _first(mine: Int64, other: Int64) -> int | None:
    differs = mine != other
    index = int(differs.argmax()) if len(differs) else 0
    return index if len(differs) and differs[index] else None


def first_difference(finished: Finished) -> str | None:
    """Return the first key whose value differs from `results.json`, or None.

    Results that cannot be read differ, too: what is wrong with them is returned.
    """
    return _compared(finished)[0]


def compare_with_live(finished: Finished) -> tuple[str | None, ExitCode]:
    """Return the first difference from the live results, and its exit code.

    Without a difference it is None.

    Where this version gives other results than it gave live, the frames are not those of then: that is no pass. What
    another version finds may differ. Live results that cannot be read are bad input, and no pass either.
    """
    code = finished.results.code
    found, instead = _compared(finished)
    return found, code or instead


def _compared(finished: Finished) -> tuple[str | None, ExitCode]:
    """Return the first difference from live results, and what it makes of a pass.

    The second is an exit code.
    """
    if not finished.record.is_recorded:  # such a run says nothing of the unit, live or now
        return "the run received frames that could not be recorded; these are the results of those that were", (
            ExitCode.DONE
        )
    try:
        live = finished.session.read_results_unchecked()
    except InputError as error:
        return str(error), ExitCode.BAD_INPUT
    found = _difference(result_as_dict(live), result_as_dict(finished.results), "")
    same_code = made_by(live.versions, live.plugins) == made_by(finished.results.versions, finished.results.plugins)
    is_other = found is not None and same_code
    return found, ExitCode.INCONCLUSIVE if is_other else ExitCode.DONE


def _difference(before: object, now: object, key: str) -> str | None:
    if isinstance(before, dict) and isinstance(now, dict):
        names = [name for name in dict.fromkeys((*before, *now)) if f"{key}{name}" not in {"versions", "plugins"}]
        pairs = [(f"{key}{name}", before.get(name), now.get(name)) for name in names]
    elif isinstance(before, list) and isinstance(now, list):
        if len(before) != len(now):
            return f"{key.removesuffix('.')}: {len(before)} of them live, {len(now)} now"
        pairs = [(f"{key}{index}", *pair) for index, pair in enumerate(zip(before, now, strict=True))]
    elif before == now or (before != before and now != now):  # noqa: PLR0124 (NaN)
        return None
    else:
        return f"{key}: {shortened(repr(before))} live, {shortened(repr(now))} now"
    return next(
        (found for name, a, b in pairs if (found := _difference(a, b, f"{name}." if _nested(a) else name))), None
    )


def _nested(value: object) -> bool:
    return isinstance(value, dict | list)


def changes(before: RunResult, now: RunResult) -> list[tuple[str, str, str]]:
    """Return what a new judgement changed: what, before, now."""
    rows: list[tuple[str, object, object]] = [
        ("bench outcome", before.bench.outcome, now.bench.outcome),
        ("verdict", before.unit.verdict, now.unit.verdict),
        ("reason", before.unit.reason_id, now.unit.reason_id),
    ]
    for id_ in dict.fromkeys((*before.measurements, *now.measurements)):
        old, new = before.measurements.get(id_), now.measurements.get(id_)
        unit, name = next((one.unit, one.name) for one in (new, old) if one is not None)
        for key, called in _COMPARED.items():
            a, b = getattr(old, key, None), getattr(new, key, None)
            if a != b and key != "verdict":
                a, b = _quantities(a, b, unit)
            rows.append((f"{name}{called}", a, b))
    rows.append(("exceedances", len(before.exceedances), len(now.exceedances)))
    return [(what, _plain(a), _plain(b)) for what, a, b in rows if a != b]


def _quantities(before: float | None, now: float | None, unit: str) -> tuple[str, str]:
    """Return two values with their unit, with as many digits as distinguish them."""
    texts = shown.quantity(before, unit), shown.quantity(now, unit)
    if texts[0] != texts[1]:
        return texts
    return f"{before!r} {unit}".removesuffix(" 1"), f"{now!r} {unit}".removesuffix(" 1")


def _plain(value: object) -> str:
    return "-" if value is None else str(value)


def changes_text(rows: list[tuple[str, str, str]]) -> str:
    """Return the table of what changed as plain text."""
    if not rows:
        return "  Nothing changed."
    table = [("", "before", "now"), *rows]
    widths = [max(len(row[column]) for row in table) for column in range(3)]
    return "\n".join(
        "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in table
    )
