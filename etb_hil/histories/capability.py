"""Process capability: how far the units of a part lie inside their limits.

Intervals say what so few units can tell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from etb_hil.histories.control_chart import ControlChart
from etb_hil.histories.distribution import Distribution
from etb_hil.recording.samples import Float64

ENOUGH = 25  # units; below, the manual calls a capability preliminary (AIAG, SPC, 2nd edition 2005)
_Z95 = NormalDist().inv_cdf(0.975)
_RANGES = 0.605  # of the degrees of freedom of n values, what moving ranges keep (Cryer and Ryan 1990)


@dataclass(frozen=True, slots=True)
class Index:
    """A capability index with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Capability:
    """Capability of `count` units.

    `cpk` and `cp` go by the spread from unit to unit, `ppk` by the whole spread.

    `cp` is None where only one side has a limit. Beyond the normal distribution and the lognormal one, a spread from
    unit to unit is not known: all rest on the whole one. Of a process that is not in control (`steady` False) the
    indices describe the past only.
    """

    count: int
    cpk: Index
    ppk: Index
    cp: Index | None
    steady: bool

    @property
    def is_preliminary(self) -> bool:
        """Whether there are too few units for a capability that one may quote."""
        return self.count < ENOUGH


def capability(
    chart: ControlChart, shape: Distribution | None, low: float | None, high: float | None, unsure: float = 0.0
) -> Capability | None:
    """Return the capability of a chart's values between limits.

    Their distribution is `shape`.

    Indices by quantiles: the room from the median to a limit over that to the quantile of 0.135 or 99.865 %
    (ISO 22514-2). Intervals of the normal families: Bissell (1990) for Cpk and Ppk, chi-squared for Cp; of others the
    basic bootstrap of the logarithm. Those of a normal family reach as far as those of a distribution of free shape,
    since no test can tell that the values are normal. All values may be off together by `unsure`, 95 %: that widens
    those of Cpk and Ppk. None without a limit, without any spread, or without a distribution.
    """
    if shape is None or (low is None and high is None) or chart.sigma == 0.0:
        return None
    count, steady = len(chart.values), chart.is_steady
    if not shape.is_normal:
        whole = _by_replicates(shape, low, high, unsure)
        width = None if low is None or high is None else _width_by_replicates(shape, high - low)
        return Capability(count, whole, whole, width, steady)
    freedom = _RANGES * (count - 1)
    inside = chart.sigma / float(chart.values.std(ddof=1))  # the spread from unit to unit in shares of the whole one
    at = np.array([shape.low, shape.median, shape.high])
    value, reach = (float(each) for each in _nearest(at, low, high))
    cpk = _bissell(value / inside, unsure / (inside * reach), count, freedom)
    ppk = _bissell(value, unsure / reach, count, count - 1.0)
    cp = None
    if low is not None and high is not None:
        cp = _width((high - low) / (inside * (shape.high - shape.low)), freedom)
    if shape.free is not None:
        free = _by_replicates(shape.free, low, high, unsure)
        cpk, ppk = _reaching(cpk, free, inside), _reaching(ppk, free, 1.0)
        if cp is not None and low is not None and high is not None:
            cp = _reaching(cp, _width_by_replicates(shape.free, high - low), inside)
    return Capability(count, cpk, ppk, cp, steady)


def _reaching(index: Index, other: Index, inside: float) -> Index:
    """Return an index whose interval holds that of another.

    The spread of the other counts `inside` times.
    """
    return Index(index.value, min(index.low, other.low / inside), max(index.high, other.high / inside))


def _nearest(at: Float64, low: float | None, high: float | None) -> tuple[Float64, Float64]:
    """Return the smaller index (...) and its divisor, from quantiles (..., 3).

    The quantiles are those of 0.135, 50 and 99.865 %.
    """
    below, middle, above = at[..., 0], at[..., 1], at[..., 2]
    lower = np.full(middle.shape, np.inf) if low is None else (middle - low) / (middle - below)
    upper = np.full(middle.shape, np.inf) if high is None else (high - middle) / (above - middle)
    return np.minimum(lower, upper), np.where(lower < upper, middle - below, above - middle)


def _bissell(value: float, unsure: float, count: int, freedom: float) -> Index:
    half = math.hypot(_Z95 * math.sqrt(1.0 / (9.0 * count) + value * value / (2.0 * freedom)), unsure)
    return Index(value, value - half, value + half)


def _width(value: float, freedom: float) -> Index:
    from scipy.special import chdtri  # noqa: PLC0415 (a tenth of a second, which few runs need)

    low, high = (math.sqrt(float(chdtri(freedom, beyond)) / freedom) for beyond in (0.975, 0.025))
    return Index(value, value * low, value * high)


def _by_replicates(shape: Distribution, low: float | None, high: float | None, unsure: float) -> Index:
    """Return Ppk with an interval by replicates.

    The interval is symmetric to theirs in the logarithm where all are above zero.
    """
    value, reach = (float(each) for each in _nearest(np.array([shape.low, shape.median, shape.high]), low, high))
    among, _ = _nearest(shape.replicates[:, [0, 1, 3]], low, high)
    index = _basic(value, among)
    off = unsure / reach
    return Index(value, value - math.hypot(value - index.low, off), value + math.hypot(index.high - value, off))


def _width_by_replicates(shape: Distribution, width: float) -> Index:
    return _basic(width / (shape.high - shape.low), width / (shape.replicates[:, 3] - shape.replicates[:, 0]))


def _basic(value: float, among: Float64) -> Index:
    least, most = np.quantile(among, [0.025, 0.975]).tolist()
    if least > 0.0:
        return Index(value, value * value / most, value * value / least)
    return Index(value, 2.0 * value - most, 2.0 * value - least)
