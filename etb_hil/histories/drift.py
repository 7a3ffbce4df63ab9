"""Drift: units and benches whose values move with time, and values that jump."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.recording.samples import Float64

FALSE_ALARMS = 0.01  # chance that a whole report without any drift holds an alarm
FEWEST = 8  # values, of which a trend is looked for
_CARRIED = 0.05  # p-value that a bench's trend must keep without the unit that shows it most


@dataclass(frozen=True, slots=True)
class Point:
    """A value at `time` s, as a deviation in shares from its unit's level on the bench."""

    time: float
    unit: str
    bench: str
    deviation: float


@dataclass(frozen=True, slots=True)
class Drift:
    """A trend of a unit or a bench (`kind`) over `count` runs: `change` from first to last with its 95 % interval.

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
    """Return each value's deviation from the mean of its unit on its bench, where that was measured again.

    `time` (n) in s, `values` (n). Deviations of few values are stretched to those of many: sqrt(n / (n - 1)).
    """
    cells: dict[tuple[str, str], list[int]] = {}
    for index, cell in enumerate(zip(units, benches, strict=True)):
        cells.setdefault(cell, []).append(index)
    points = []
    for (unit, bench), where in cells.items():
        if len(where) > 1 and (level := float(values[where].mean())) != 0.0:
            stretch = (len(where) / (len(where) - 1)) ** 0.5
            points += [Point(float(time[k]), unit, bench, (float(values[k]) / level - 1.0) * stretch) for k in where]
    return sorted(points, key=lambda point: point.time)


def drifts(points: Sequence[Point]) -> tuple[list[Drift], int]:
    """Return the benches and units that drift, benches first, and how many were looked at.

    A trend is Kendall's; all tests of one report share a chance of false alarm of 1 %. A bench drifts where the trend
    stays without any one of its units; of a unit on a bench that drifts, what the other units did there is taken out.
    """
    by_bench = _groups(points, "bench")
    by_unit = _groups(points, "unit")
    looked_at = len(by_bench) + len(by_unit)
    least = FALSE_ALARMS / max(looked_at, 1)
    found: list[Drift] = []
    for name, group in by_bench.items():
        trend = _trend("bench", name, group)
        if trend.p < least and _is_shared(group):
            found.append(trend)
    drifting = {drift.name for drift in found}
    for name, group in by_unit.items():
        others = [p for p in points if p.unit != name]
        trend = _trend("unit", name, [_apart(p, others) if p.bench in drifting else p for p in group])
        if trend.p < least:
            found.append(replace(trend, alone=not {p.bench for p in group} & {p.bench for p in others}))
    return found, looked_at


def _groups(points: Sequence[Point], key: str) -> dict[str, list[Point]]:
    groups: dict[str, list[Point]] = {}
    for point in points:
        groups.setdefault(getattr(point, key), []).append(point)
    return {name: group for name, group in sorted(groups.items()) if len(group) >= FEWEST}


def _trend(kind: str, name: str, group: Sequence[Point]) -> Drift:
    from scipy.stats import kendalltau, theilslopes  # noqa: PLC0415 (half a second, which few runs need)

    time = np.array([point.time for point in group])
    values = np.array([point.deviation for point in group])
    span = float(time[-1] - time[0])
    if span == 0.0 or np.ptp(values) == 0.0:
        return Drift(kind, name, len(group), 0.0, 0.0, 0.0, 1.0)
    p = float(kendalltau(time, values).pvalue)
    slope = theilslopes(values, time, 0.95)
    change, low, high = (float(each) * span for each in (slope[0], slope[2], slope[3]))
    return Drift(kind, name, len(group), change, low, high, p)


def _is_shared(group: Sequence[Point]) -> bool:
    """Return whether a bench's trend is there without any one of its units."""
    rest = [[p for p in group if p.unit != unit] for unit in {p.unit for p in group}]
    return all(len(r) >= FEWEST and _trend("bench", "", r).p < _CARRIED for r in rest)


def _apart(point: Point, others: Sequence[Point]) -> Point:
    """Return a deviation less what the other units on the same bench did about then, if there were any."""
    there = [p for p in others if p.bench == point.bench]
    if len(there) < FEWEST:
        return point
    near = sorted(there, key=lambda p: abs(p.time - point.time))[: FEWEST // 2]
    return Point(point.time, point.unit, point.bench, point.deviation - float(np.mean([p.deviation for p in near])))
