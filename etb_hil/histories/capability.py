"""Process capability: how far the units of a part lie inside their limits, with what so few of them can tell."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

from etb_hil.histories.control_chart import ControlChart

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
    """Capability of `count` units: `cpk` and `cp` with the spread from unit to unit, `ppk` with the whole spread.

    `cp` is None where only one side has a limit. A process that is not steady (`steady` False) has no capability that
    would hold tomorrow; the indices then only say how the past was.
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


def capability(chart: ControlChart, low: float | None, high: float | None, unsure: float = 0.0) -> Capability | None:
    """Return the capability of the values of a chart between limits; None without a limit or without any spread.

    Intervals: Bissell (1990) for Cpk and Ppk, chi-squared for Cp; normally distributed values are taken for granted.
    All values may be off together by `unsure`, 95 %: that widens those of Cpk and Ppk.
    """
    if low is None and high is None:
        return None
    count = len(chart.values)
    overall = float(chart.values.std(ddof=1))
    if chart.sigma == 0.0 or overall == 0.0:
        return None
    freedom = _RANGES * (count - 1)
    room = min(
        math.inf if low is None else chart.centre - low,
        math.inf if high is None else high - chart.centre,
    )
    return Capability(
        count,
        _nearest(room, 3.0 * chart.sigma, unsure, count, freedom),
        _nearest(room, 3.0 * overall, unsure, count, count - 1.0),
        None if low is None or high is None else _width((high - low) / (6.0 * chart.sigma), freedom),
        steady=not chart.signals,
    )


def _nearest(room: float, spread: float, unsure: float, count: int, freedom: float) -> Index:
    value = room / spread
    half = math.hypot(_Z95 * math.sqrt(1.0 / (9.0 * count) + value * value / (2.0 * freedom)), unsure / spread)
    return Index(value, value - half, value + half)


def _width(value: float, freedom: float) -> Index:
    from scipy.special import chdtri  # noqa: PLC0415 (an extra)

    low, high = (math.sqrt(float(chdtri(freedom, beyond)) / freedom) for beyond in (0.975, 0.025))
    return Index(value, value * low, value * high)
