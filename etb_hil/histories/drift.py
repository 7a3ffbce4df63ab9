"""Drift: units and benches whose values move with time, and values that jump."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from etb_hil.recording.samples import Float64

FALSE_ALARMS = 0.01  # chance that a report without any drift (one part, one scenario) holds an alarm
FEWEST = 8  # values, of which a trend is looked for
_MOST_COMPARED = 1000  # points, of whose pairs the slope is the median
_NEAREST = 4  # values of other units that tell what a bench did about then
_CARRIED = 0.05  # p-value that a bench's trend must keep without the unit that shows it most


class Point(NamedTuple):
    """A value at `time` s, as a share off its unit's level on the bench."""

    time: float
    unit: str
    bench: str
    deviation: float


@dataclass(frozen=True, slots=True)
class Drift:
    """A trend of a unit or a bench (`kind`) over `count` runs.

    `change` is that from first to last, with its 95 % interval.

    `p` is how often chance alone would show as much (Kendall's test). `alone`: no other unit was measured again on the
    unit's benches, so that the trend may be theirs.
    """

    kind: str
    name: str
    count: int
    change: float
    low: float
    high: float
    p: float
    alone: bool = False


def deviations(time: Float64, values: Float64, units: Sequence[str], benches: Sequence[str]) -> list[Point]:
    """Return each value's deviation from the mean of its unit on its bench.

    Units that were measured once have none.

    `time` (n) in s, `values` (n). Deviations of few values are stretched to those of many: sqrt(n / (n - 1)).
    """
    known: dict[tuple[str, str], int] = {}
    cell = np.array([known.setdefault(one, len(known)) for one in zip(units, benches, strict=True)], dtype=np.int64)
    count = np.bincount(cell, minlength=len(known))
    level = np.bincount(cell, values, len(known)) / count
    again = np.flatnonzero((count[cell] > 1) & (level[cell] != 0.0))
    of = cell[again]
    stretched = (values[again] / level[of] - 1.0) * np.sqrt(count[of] / (count[of] - 1.0))
    points = [
        Point(at, units[k], benches[k], value)
        for k, at, value in zip(again.tolist(), time[again].tolist(), stretched.tolist(), strict=True)
    ]
    return sorted(points, key=lambda point: point.time)


def series_of(points: Sequence[Point]) -> int:
    """Return how many benches and units have enough values for a trend."""
    return sum(len(_groups(points, key)) for key in ("bench", "unit"))


def drifts(points: Sequence[Point], elsewhere: int = 0) -> tuple[list[Drift], int]:
    """Return the benches, then the units, that drift, and how many were looked at.

    `points` (sorted by time) are those of `deviations`. A trend is Kendall's; all tests of one report share a chance
    of false alarm of 1 % (Bonferroni): those of these points, and of its other measurements (`elsewhere` series). A
    bench drifts where the trend stays without any one of its units; of a unit on a bench that drifts, what the other
    units did there is taken out.
    """
    by_bench = _groups(points, "bench")
    by_unit = _groups(points, "unit")
    looked_at = len(by_bench) + len(by_unit)
    tests = looked_at + elsewhere
    found: list[Drift] = []
    for name, group in by_bench.items():
        if _rank_trend(group).p * tests < FALSE_ALARMS and _is_shared(group):
            found.append(_drift("bench", name, group))
    drifting = {drift.name for drift in found}
    for name, group in by_unit.items():
        own = {p.bench for p in group}
        others = {bench: [p for p in by_bench[bench] if p.unit != name] for bench in own & drifting}
        group = [_apart(p, others.get(p.bench, ())) for p in group]  # noqa: PLW2901
        if _rank_trend(group).p * tests < FALSE_ALARMS:
            alone = not any(p.bench in own and p.unit != name for p in points)
            found.append(replace(_drift("unit", name, group), alone=alone))
    return found, looked_at


def _groups(points: Sequence[Point], key: str) -> dict[str, list[Point]]:
    groups: dict[str, list[Point]] = {}
    for point in points:
        groups.setdefault(getattr(point, key), []).append(point)
    return {name: group for name, group in sorted(groups.items()) if len(group) >= FEWEST}


@dataclass(frozen=True, slots=True)
class _RankTrend:
    """Kendall's tau and its p-value.

    Both are NaN, which is below no level, where all values are equal or of one instant.
    """

    tau: float
    p: float


def _rank_trend(group: Sequence[Point]) -> _RankTrend:
    from scipy.stats import kendalltau  # noqa: PLC0415 (half a second, which few runs need)

    found = kendalltau(*_columns(group))
    return _RankTrend(float(found.statistic), float(found.pvalue))


def _drift(kind: str, name: str, group: Sequence[Point]) -> Drift:
    """Return the trend by Theil and Sen.

    All pairs are compared; of many points, those of some at even distances.
    """
    from scipy.stats import theilslopes  # noqa: PLC0415 (likewise)

    time, values = _columns(group)
    span = float(time[-1] - time[0])
    some = np.linspace(0, len(group) - 1, min(len(group), _MOST_COMPARED)).astype(int)
    slope = theilslopes(values[some], time[some], 0.95)
    change, low, high = (float(each) * span for each in (slope[0], slope[2], slope[3]))
    return Drift(kind, name, len(group), change, low, high, _rank_trend(group).p)


def _columns(group: Sequence[Point]) -> tuple[Float64, Float64]:
    return np.array([point.time for point in group]), np.array([point.deviation for point in group])


def _is_shared(group: Sequence[Point]) -> bool:
    """Return whether a bench's trend is there without any one of its units.

    A unit with so few points that their pairs cannot undo the trend is not tried. Of n points, m have at most 2 m / n
    of all pairs, and tau of points without a trend has a standard deviation of about 2 / (3 sqrt(n)).
    """
    counts = Counter(point.unit for point in group)
    count = len(group)
    kept = abs(_rank_trend(group).tau) - 5.0 / (3.0 * math.sqrt(count))  # 2.5 standard deviations, where 1.96 are asked
    doubted = [unit for unit, points in counts.items() if 2 * points / count >= kept]
    rest = ([p for p in group if p.unit != unit] for unit in doubted)
    return all(len(r) >= FEWEST and _rank_trend(r).p < _CARRIED for r in rest)


def _apart(point: Point, others: Sequence[Point]) -> Point:
    """Return a deviation less that of other units on the bench about then.

    Without enough of them it stays as it is. They are sorted by time.
    """
    if len(others) < FEWEST:
        return point
    at = bisect_left(others, point.time, key=_time)
    about = others[max(at - _NEAREST, 0) : at + _NEAREST]
    near = sorted(about, key=lambda p: abs(p.time - point.time))[:_NEAREST]
    return point._replace(deviation=point.deviation - float(np.mean([p.deviation for p in near])))


def _time(point: Point) -> float:
    return point.time
