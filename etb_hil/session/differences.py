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
    from collections.abc import Iterator, Mapping

    from etb_hil.recording.recording import Recording
    from etb_hil.recording.samples import Float64, Int64
    from etb_hil.results.measurement import Measurement
    from etb_hil.results.run_result import RunResult
    from etb_hil.session.finished import Finished

    _Timed = tuple[Int64, Mapping[str, Float64]]  # times in ns, and columns of values at these times

_COMPARED = {
    "value_or_bound": "",
    "limit_low": ", lower limit",
    "limit_high": ", upper limit",
    "verdict": ", verdict",
}
_ALL_DIGITS = 17  # of a 64 bit number
_CODE = {("versions",), ("plugins",)}  # of results: what made them


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

    Estimates at 1 kHz count as well. NaN equals NaN, and a signal that one run lacks is NaN there.
    """
    origin_ns = there.record.start_ns
    found = [*_samples(here, there, origin_ns), *_estimates(here, there, origin_ns)]
    return min(found, key=lambda divergence: divergence.time_s, default=None)


def _samples(here: Finished, there: Finished, origin_ns: int) -> Iterator[Divergence]:
    ours, theirs = here.analysis.recording, there.analysis.recording
    for source in dict.fromkeys((*ours.sources, *theirs.sources)):
        mine, other = (_timed(recording, source) for recording in (ours, theirs))
        yield from _divergences(source, mine, other, origin_ns)


def _timed(recording: Recording, source: str) -> _Timed:
    if source not in recording.sources:
        return np.empty(0, np.int64), {}
    block = recording.block(source)
    return block.time_ns, block.columns


def _estimates(here: Finished, there: Finished, origin_ns: int) -> Iterator[Divergence]:
    mine, other = (
        (
            found.start_ns + np.rint(found.series["time"] * 1e9).astype(np.int64),
            {name: found.series[name] for name in ("velocity", "friction")},
        )
        for found in (here.found, there.found)
    )
    yield from _divergences("estimate", mine, other, origin_ns)


def _divergences(source: str, mine: _Timed, other: _Timed, origin_ns: int) -> Iterator[Divergence]:
    """Yield the first difference of the times of one source, and of each column."""
    (my_ns, my_columns), (other_ns, other_columns) = mine, other
    count = min(len(my_ns), len(other_ns))
    index = _first(my_ns[:count], other_ns[:count])
    if index is None and len(my_ns) != len(other_ns):
        index = count
    if index is not None:
        times = [(int(one[index]) - origin_ns) * 1e-9 if index < len(one) else np.nan for one in (my_ns, other_ns)]
        yield Divergence(f"{source}.time", float(np.nanmin(times)), *times)
    missing = np.full(count, np.nan)
    for name in sorted(my_columns.keys() | other_columns.keys()):
        here, there = (columns.get(name, missing)[:count] for columns in (my_columns, other_columns))
        index = _first(_bits(here), _bits(there))
        if index is not None:
            time_s = (int(my_ns[index]) - origin_ns) * 1e-9
            yield Divergence(f"{source}.{name}", time_s, float(here[index]), float(there[index]))


def _bits(values: Float64) -> Int64:
    """Return the bits of values; those of every NaN are the same."""
    return np.where(np.isnan(values), np.nan, values).view(np.int64)


def _first(mine: Int64, other: Int64) -> int | None:
    return next(iter(np.flatnonzero(mine != other).tolist()), None)


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
    found = _difference(result_as_dict(live), result_as_dict(finished.results))
    same_code = made_by(live.versions, live.plugins) == made_by(finished.results.versions, finished.results.plugins)
    is_other = found is not None and same_code
    return found, ExitCode.INCONCLUSIVE if is_other else ExitCode.DONE


def _difference(before: object, now: object, *keys: str) -> str | None:
    """Return the first key at which two values differ, with both, or None."""
    if isinstance(before, dict) and isinstance(now, dict):
        names = [name for name in dict.fromkeys((*before, *now)) if (*keys, name) not in _CODE]
        pairs = [(name, before.get(name), now.get(name)) for name in names]
    elif isinstance(before, list) and isinstance(now, list):
        if len(before) != len(now):
            return f"{'.'.join(keys)}: {len(before)} of them live, {len(now)} now"
        pairs = [(str(index), one, now[index]) for index, one in enumerate(before)]
    elif before == now or (before != before and now != now):  # noqa: PLR0124 (NaN)
        return None
    else:
        return f"{'.'.join(keys)}: {shortened(repr(before))} live, {shortened(repr(now))} now"
    return next((found for name, one, other in pairs if (found := _difference(one, other, *keys, name))), None)


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
            if key != "verdict":
                a, b = _quantities(a, b, unit)
            if key == "value_or_bound":
                a, b = _bounded(a, old), _bounded(b, new)
            rows.append((f"{name}{called}", a, b))
    rows.append(("exceedances", len(before.exceedances), len(now.exceedances)))
    return [(what, _plain(a), _plain(b)) for what, a, b in rows if a != b]


def _quantities(before: float | None, now: float | None, unit: str) -> tuple[str, str]:
    """Return two values with their unit, with as many digits as distinguish them."""
    texts = shown.quantity(before, unit), shown.quantity(now, unit)
    if texts[0] != texts[1] or before is None or now is None or before == now:
        return texts
    digits = next(
        (count for count in range(5, _ALL_DIGITS) if f"{before:.{count}g}" != f"{now:.{count}g}"), _ALL_DIGITS
    )
    return f"{before:.{digits}g} {unit}".removesuffix(" 1"), f"{now:.{digits}g} {unit}".removesuffix(" 1")


def _bounded(text: object, one: Measurement | None) -> object:
    return f"at most {text}" if one is not None and one.is_bound else text


def _plain(value: object) -> str:
    return "-" if value is None else str(value)


def changes_text(rows: list[tuple[str, str, str]]) -> str:
    """Return the table of what changed as plain text."""
    if not rows:
        return "  Nothing changed."
    table = [("", "before", "now"), *rows]
    widths = [max(len(row[column]) for row in table) for column in range(3)]
    return "\n".join(
        "  " + "  ".join(row[column].ljust(width) for column, width in enumerate(widths)).rstrip() for row in table
    )
