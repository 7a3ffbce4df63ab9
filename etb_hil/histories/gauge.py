"""Gauge repeatability and reproducibility of the benches.

The study is a crossed study by analysis of variance.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from etb_hil.histories.rounding import without_rounding
from etb_hil.recording.samples import Float64, Int64

GOOD = 0.10  # share of the study's variation below which a gauge is good (AIAG, MSA, 4th edition 2010, II.D)
ENOUGH_CATEGORIES = 5  # groups of units that a gauge must distinguish (likewise)
_CATEGORY = 1.41  # of PV / GRR: groups whose 97 % intervals do not overlap (likewise)
# Share of the study's variation at which it distinguishes just so many: 27 %. The manual calls a gauge conditionally
# acceptable up to 30 %; its categories decide before.
USABLE = 1.0 / math.hypot(1.0, ENOUGH_CATEGORIES / _CATEGORY)
ENOUGH_UNITS = 10  # that a study has to have (likewise)
_MOST_TRIED = 8  # benches of which all sets are tried: 255
POOLED_ABOVE = 0.25  # an interaction less significant than this goes into repeatability (AIAG, MSA)


@dataclass(frozen=True, slots=True)
class AnovaRow:
    """A source of variation: degrees of freedom, sum of squares, F and p-value.

    F and p-value are None where there is none.
    """

    source: str
    freedom: int
    squares: float
    ratio: float | None = None
    p: float | None = None

    @property
    def mean_square(self) -> float:
        """The sum of squares per degree of freedom."""
        return self.squares / self.freedom


@dataclass(frozen=True, slots=True)
class GaugeStudy:
    """Standard deviations by source, in the unit of the values.

    They are from `units` x `benches` x `trials` runs.

    `repeatability` (EV) of one bench with one unit, `reproducibility` (AV) between benches with what units and
    benches do together, `part` (PV) between units. `reproducibility` is None of one bench: nothing tells it.
    """

    units: int
    benches: int
    trials: int
    anova: tuple[AnovaRow, ...]
    pooled: bool
    repeatability: float
    reproducibility: float | None
    part: float

    @property
    def gauge(self) -> float:
        """GRR: repeatability and reproducibility together."""
        return math.hypot(self.repeatability, self.reproducibility or 0.0)

    @property
    def total(self) -> float:
        """TV: the whole variation in the study."""
        return math.hypot(self.gauge, self.part)

    def share(self, sigma: float) -> float:
        """Return a standard deviation as a share of the total (% study variation).

        It is 0 where nothing varies.
        """
        return sigma / self.total if self.total > 0.0 else 0.0

    @property
    def verdict(self) -> str:
        """What the gauge is good for: good, usable, unsuitable or unknown.

        Its share of the variation decides, and its categories. It is unknown where repeats do not scatter, unless what
        lies between benches is too much already.
        """
        if self.categories is not None and self.categories < ENOUGH_CATEGORIES:
            return "unsuitable"
        if not self.is_resolved:
            return "unknown"
        return "good" if self.share(self.gauge) < GOOD else "usable"

    @property
    def is_resolved(self) -> bool:
        """Whether repeats scatter.

        Where they do not, the resolution of the values hides the scatter of the gauge.
        """
        return self.repeatability > 0.0

    @property
    def categories(self) -> int | None:
        """ndc: how many groups of units the gauge distinguishes.

        None where it does not scatter at all.
        """
        return int(_CATEGORY * self.part / self.gauge) if self.gauge > 0.0 else None


def gauge_study(values: Float64) -> GaugeStudy:
    """Return the study of values (units, benches, trials).

    There are at least 2 units, 1 bench and 2 trials.

    Random effects by analysis of variance; the interaction is pooled with the error where its p-value exceeds 0.25
    (AIAG, Measurement Systems Analysis, 4th edition 2010, chapter III, section B, and appendix A). Negative variance
    estimates count as zero, and so does rounding.
    """
    units, benches, trials = values.shape
    mean = values.mean()
    by_unit, by_bench, cell = values.mean(axis=(1, 2)), values.mean(axis=(0, 2)), values.mean(axis=2)

    def squares(deviations: Float64) -> float:
        return float((without_rounding(deviations, values) ** 2).sum())

    unit = AnovaRow("units", units - 1, benches * trials * squares(by_unit - mean))
    error = AnovaRow("repeatability", units * benches * (trials - 1), squares(values - cell[:, :, None]))
    if benches == 1:
        part = _sigma((unit.mean_square - error.mean_square) / trials)
        return GaugeStudy(
            units, 1, trials, (_tested(unit, error), error), False, math.sqrt(error.mean_square), None, part
        )
    bench = AnovaRow("benches", benches - 1, units * trials * squares(by_bench - mean))
    both = AnovaRow(
        "units x benches",
        (units - 1) * (benches - 1),
        trials * squares(cell - by_unit[:, None] - by_bench + mean),
    )
    both = _tested(both, error)
    pooled = both.p is not None and both.p > POOLED_ABOVE
    rows: tuple[AnovaRow, ...] = (_tested(unit, both), _tested(bench, both), both, error)
    if pooled:
        base = AnovaRow("repeatability", error.freedom + both.freedom, error.squares + both.squares)
        rows = (*rows, AnovaRow("pooled", base.freedom, base.squares))
        interaction = 0.0
    else:
        base, interaction = both, (both.mean_square - error.mean_square) / trials
    repeatability = math.sqrt(base.mean_square if pooled else error.mean_square)
    between = max((bench.mean_square - base.mean_square) / (units * trials), 0.0)
    part = _sigma((unit.mean_square - base.mean_square) / (benches * trials))
    reproducibility = math.sqrt(between + max(interaction, 0.0))
    return GaugeStudy(units, benches, trials, rows, pooled, repeatability, reproducibility, part)


def _tested(row: AnovaRow, against: AnovaRow) -> AnovaRow:
    if against.mean_square == 0.0:
        return row
    from scipy.special import fdtrc  # noqa: PLC0415 (a tenth of a second, which few runs need)

    ratio = row.mean_square / against.mean_square
    return AnovaRow(row.source, row.freedom, row.squares, ratio, float(fdtrc(row.freedom, against.freedom, ratio)))


def _sigma(variance: float) -> float:
    return math.sqrt(max(variance, 0.0))


def balanced(cells: dict[tuple[str, str], list[float]]) -> tuple[list[str], list[str], Float64] | None:
    """Return the largest crossed study in `cells`, or None.

    The study is units, benches and values (units, benches, trials).

    `cells` maps (unit, bench) to values in order of time; the latest ones are taken. A study needs two units, each
    twice on every bench of it. Studies of two benches or more come first, since they alone tell reproducibility; then
    those of ten units or more, which the manual requires; then the one of most values, and of most units among those.
    Of up to eight benches all sets are tried; of more, the best pair and what it becomes by one bench after another.
    """
    again = [cell for cell, values in cells.items() if len(values) > 1]
    units, benches = (sorted({cell[k] for cell in again}) for k in (0, 1))
    counts = np.array([[len(cells.get((unit, bench), ())) for bench in benches] for unit in units], dtype=np.int64)
    best = max((_size(counts, together) for together in _sets_of(counts)), key=_rank, default=_NONE)
    if not best.values:
        return None
    together = [benches[k] for k in best.together]
    shared = [units[k] for k in np.flatnonzero(counts[:, best.together].min(axis=1) >= best.trials)]
    return shared, together, np.array([[cells[unit, b][-best.trials :] for b in together] for unit in shared])


class _Size(NamedTuple):
    """A crossed study that the runs hold: its criteria in order of preference.

    Behind them are its trials, and `together`, the places of its benches.
    """

    has_reproducibility: bool
    has_enough_units: bool
    values: int
    units: int
    trials: int
    together: tuple[int, ...]


_NONE = _Size(False, False, 0, 0, 0, ())


def _rank(size: _Size) -> tuple[bool, bool, int, int]:
    return size[:4]


def _size(counts: Int64, together: tuple[int, ...]) -> _Size:
    """Return the largest study on some benches.

    `counts` (units, benches) is how often each unit ran on each bench.
    """
    trials = np.sort(counts[:, together].min(axis=1))[::-1]  # the first k units have trials[k - 1] runs on each bench
    units = np.arange(1, len(trials) + 1)
    values = np.where((units > 1) & (trials > 1), units * trials * len(together), 0)
    enough = values * (units >= ENOUGH_UNITS)
    has_enough = bool(enough.any())
    chosen = enough if has_enough else values
    if not chosen.any():
        return _NONE
    last = int(np.flatnonzero(chosen == chosen.max())[-1])
    return _Size(len(together) > 1, has_enough, int(chosen[last]), last + 1, int(trials[last]), together)


def _sets_of(counts: Int64) -> Iterator[tuple[int, ...]]:
    """Yield the sets of benches that are tried, as their places.

    They are all sets of few benches; of many, each bench, each pair, and the best pair as it grows. Each bench that is
    added is the one with which the study stays the largest.
    """
    places = range(counts.shape[1]) if counts.size else range(0)
    exhaustive = len(places) <= _MOST_TRIED
    for count in places if exhaustive else (0, 1):
        yield from combinations(places, count + 1)
    if exhaustive:
        return
    grown: tuple[int, ...] = max(combinations(places, 2), key=lambda pair: _rank(_size(counts, pair)))
    while len(grown) < len(places):
        grown = max(
            (tuple(sorted((*grown, k))) for k in places if k not in grown), key=lambda some: _rank(_size(counts, some))
        )
        yield grown
