"""The distribution of a quantity from unit to unit.

Its tolerance limit and its capability both rest on it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from etb_hil.histories.control_chart import FEWEST
from etb_hil.histories.rounding import scatters
from etb_hil.recording.samples import Float64

REJECTED = 0.05  # p-value below which a family does not describe the values
NORMAL, LOGNORMAL, PEARSON, EMPIRICAL = "normal", "lognormal", "Pearson type III", "empirical"
# Values of which the greatest exceeds the quantile of 99.865 % with 97.5 % confidence: 1 - 0.99865^n >= 0.975.
ENOUGH = 2731
_MOST_TESTED = 5000  # values, for which Royston (1995) gives the p-value of Shapiro and Wilk's test
_QUANTILES = np.array([0.00135, 0.5, 0.99, 0.99865])  # those of 3 sigma, the median, and that of the tolerance limit
_REPLICATES = 300


@dataclass(frozen=True, slots=True)
class Distribution:
    """A distribution of `count` values: its family and some quantiles.

    The quantiles are those of 0.135, 50, 99 and 99.865 %.

    `p` is the p-value at which its own test did not reject it (None of the empirical one), `rejected` has those of the
    families that were. `replicates` (k, 4) are quantiles of as many bootstrap samples; none of the normal families,
    whose intervals have closed forms. These hold for normal values alone, and no test can tell that values are normal
    (Leeb and Poetscher 2005): `free` is the distribution of the same values whose shape is fitted, too.
    """

    family: str
    p: float | None
    rejected: dict[str, float]
    count: int
    low: float
    median: float
    most: float
    high: float
    replicates: Float64 = field(default_factory=lambda: np.empty((0, len(_QUANTILES))))
    free: Distribution | None = None

    @property
    def is_normal(self) -> bool:
        """Whether the values, or their logarithms, are normally distributed."""
        return not len(self.replicates)


def distribution(values: Float64, *, by_shares: bool = False) -> Distribution | None:
    """Return the distribution of values (n >= 8).

    None where they do not scatter, or nothing describes them.

    Normal, or lognormal where a quantity scatters `by_shares` and is above zero, unless Shapiro and Wilk's test rejects
    that at 5 %. Then Pearson type III by L-moments, unless a bootstrapped Cramer-von Mises test rejects it; from 2,731
    values on the empirical one in its place.
    """
    if len(values) < FEWEST or not scatters(values) or (by_shares and not np.all(values > 0.0)):
        return None
    family = LOGNORMAL if by_shares else NORMAL
    p = _normal_p(np.log(values) if by_shares else values)
    if p >= REJECTED:
        free = _empirical(values, {}) if len(values) >= ENOUGH else _pearson(values, {})
        return replace(normal(values, p, by_shares=by_shares), free=free)
    if len(values) >= ENOUGH:
        return _empirical(values, {family: p})
    tested = _pearson(values, {family: p}, is_tested=True)
    return tested if tested.p is None or tested.p >= REJECTED else None


def normal(values: Float64, p: float = 1.0, *, by_shares: bool = False) -> Distribution:
    """Return the normal or lognormal distribution of values (n), untested."""
    level = np.log(values) if by_shares else values
    at = level.mean() + level.std(ddof=1) * np.array([-3.0, 0.0, 2.3263, 3.0])
    low, median, most, high = (np.exp(at) if by_shares else at).tolist()
    return Distribution(LOGNORMAL if by_shares else NORMAL, p, {}, len(values), low, median, most, high)


def _normal_p(values: Float64) -> float:
    from scipy.stats import shapiro  # noqa: PLC0415 (half a second)

    tested = values[np.linspace(0, len(values) - 1, min(len(values), _MOST_TESTED)).astype(int)]
    return float(shapiro((tested - tested.mean()) / tested.std()).pvalue)


def _pearson(values: Float64, rejected: dict[str, float], *, is_tested: bool = False) -> Distribution:
    """Return the Pearson type III distribution of values.

    The distribution has the p-value of its own test where it `is_tested`.
    """
    from etb_hil.histories.pearson import Pearson  # noqa: PLC0415 (a tenth of a second, which few runs need)

    fitted = Pearson.of(values[None, :])
    draws = np.random.default_rng(len(values)).standard_gamma(fitted.shape[0], (_REPLICATES, len(values)))
    samples = fitted.mean[0] + fitted.scale[0] * (draws - fitted.shape[0])
    refitted = Pearson.of(samples)
    p = None
    if is_tested:
        p = float(np.mean(refitted.distance(samples) >= fitted.distance(values[None, :])[0]))
    low, median, most, high = fitted.quantiles(_QUANTILES)[0].tolist()
    return Distribution(PEARSON, p, rejected, len(values), low, median, most, high, refitted.quantiles(_QUANTILES))


def _empirical(values: Float64, rejected: dict[str, float]) -> Distribution:
    """Return the distribution of many values as they are.

    The shares of order statistics have Beta distributions.
    """
    ordered, count = np.sort(values), len(values)
    rank = np.ceil(_QUANTILES * count)
    shares = np.random.default_rng(count).beta(rank, count + 1 - rank, (_REPLICATES, len(_QUANTILES)))
    replicates = ordered[np.minimum((shares * count).astype(int), count - 1)]
    low, median, most, high = ordered[rank.astype(int) - 1].tolist()
    return Distribution(EMPIRICAL, None, rejected, count, low, median, most, high, replicates)
