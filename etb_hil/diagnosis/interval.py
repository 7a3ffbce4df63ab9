"""A value with its 95 % interval.

The intervals of several hypotheses can be combined.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from etb_hil.diagnosis.half_width import TWO_SIDED_95, share_below

_HALVINGS = 40
_OUTSIDE = 0.025  # of a 95 % interval, on either side
_LEAST = 1e-12


@dataclass(frozen=True, slots=True)
class Interval:
    """A value with its 95 % interval.

    `is_bound`: the value is known to be at most `high`, and no more; `value` and `low` are then no results.
    """

    value: float
    low: float
    high: float
    is_bound: bool = False


def at_most(high: float) -> Interval:
    """Return the interval of a value that is bounded above only."""
    return Interval(high, 0.0, high, is_bound=True)


def mixed(parts: Sequence[tuple[float, Interval]]) -> Interval:
    """Return the median of a mixture and its 2.5 and 97.5 % quantiles.

    `parts` are probabilities that sum up to 1, and intervals whose two sides are normal.
    """
    if len(parts) == 1:
        return parts[0][1]
    return Interval(_quantile(parts, 0.5), _quantile(parts, _OUTSIDE), _quantile(parts, 1.0 - _OUTSIDE))


def _quantile(parts: Sequence[tuple[float, Interval]], share: float) -> float:
    low, high = min(part.low for _, part in parts), max(part.high for _, part in parts)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        below = 0.0
        for probability, part in parts:
            side = part.value - part.low if middle < part.value else part.high - part.value
            below += probability * share_below((middle - part.value) * TWO_SIDED_95 / max(side, _LEAST))
        low, high = (middle, high) if below < share else (low, middle)
    return 0.5 * (low + high)
