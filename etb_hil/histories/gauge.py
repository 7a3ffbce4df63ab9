"""Gauge repeatability and reproducibility of the benches.

The study is a crossed study by analysis of variance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from etb_hil.recording.samples import Float64

GOOD, USABLE = 0.10, 0.30  # shares of the study's variation up to which a gauge is (AIAG, MSA, 4th edition 2010, II.D)
ENOUGH_CATEGORIES = 5  # groups of units that a gauge must distinguish (likewise)
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
        """Return a standard deviation as a share of the total (% study variation)."""
        return sigma / self.total

    @property
    def verdict(self) -> str:
        """What the gauge is good for: good, usable or unsuitable.

        Its share of the variation decides, and its categories.
        """
        if self.categories < ENOUGH_CATEGORIES:  # five are 27 % of the variation, which is below USABLE
            return "unsuitable"
        return "good" if self.share(self.gauge) < GOOD else "usable"

    @property
    def categories(self) -> int:
        """ndc: how many groups of units the gauge distinguishes."""
        return int(1.41 * self.part / self.gauge) if self.gauge > 0.0 else 0


def gauge_study(values: Float64) -> GaugeStudy:
    """Return the study of values (units, benches, trials).

    There are at least 2 units, 1 bench and 2 trials.

    Random effects by analysis of variance; the interaction is pooled with the error where its p-value exceeds 0.25
    (AIAG, Measurement Systems Analysis, 4th edition 2010, chapter III, section B, and appendix A). Negative variance
    estimates count as zero.
    """
    units, benches, trials = values.shape
    mean = values.mean()
    by_unit, by_bench, cell = values.mean(axis=(1, 2)), values.mean(axis=(0, 2)), values.mean(axis=2)
    unit = AnovaRow("units", units - 1, float(benches * trials * ((by_unit - mean) ** 2).sum()))
    error = AnovaRow("repeatability", units * benches * (trials - 1), float(((values - cell[:, :, None]) ** 2).sum()))
    if benches == 1:
        part = _sigma((unit.mean_square - error.mean_square) / trials)
        return GaugeStudy(
            units, 1, trials, (_tested(unit, error), error), False, math.sqrt(error.mean_square), None, part
        )
    bench = AnovaRow("benches", benches - 1, float(units * trials * ((by_bench - mean) ** 2).sum()))
    both = AnovaRow(
        "units x benches",
        (units - 1) * (benches - 1),
        float(trials * ((cell - by_unit[:, None] - by_bench + mean) ** 2).sum()),
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
    ratio = row.mean_square / against.mean_square
    return AnovaRow(row.source, row.freedom, row.squares, ratio, float(fdtrc(row.freedom, against.freedom, ratio)))


def _sigma(variance: float) -> float:
    return math.sqrt(max(variance, 0.0))


def balanced(cells: dict[tuple[str, str], list[float]]) -> tuple[list[str], list[str], Float64] | None:
    """Return the largest crossed study in `cells`, or None.

    The study is units, benches and values (units, benches, trials).

    `cells` maps (unit, bench) to values in order of time; the latest ones are taken. A study needs two units, each
    twice on every bench of it; more benches come first, then more values.
    """
    benches = sorted({bench for _, bench in cells})
    units = sorted({unit for unit, _ in cells})
    best: tuple[tuple[int, int], list[str], list[str], int] | None = None
    most = max((len(values) for values in cells.values()), default=0)
    for trials in range(2, most + 1):
        full = {b: {u for u in units if len(cells.get((u, b), ())) >= trials} for b in benches}
        some = [b for b in benches if len(full[b]) > 1]
        together = (
            some if len(some) > 1 and len(set.intersection(*(full[b] for b in some))) > 1 else _fullest(some, full)
        )
        if not together:
            break
        shared = sorted(set.intersection(*(full[b] for b in together)))
        size = (len(together), len(shared) * trials)
        if best is None or size > best[0]:
            best = (size, shared, together, trials)
    if best is None:
        return None
    _, shared, together, trials = best
    return shared, together, np.array([[cells[u, b][-trials:] for b in together] for u in shared])


def _fullest(benches: list[str], full: dict[str, set[str]]) -> list[str]:
    return [max(benches, key=lambda bench: len(full[bench]))] if benches else []
