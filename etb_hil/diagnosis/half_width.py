"""Half width of an interval with several errors together.

Some of them are normal, some uniform within bounds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from etb_hil.base.compiled import njit
from etb_hil.plant.exactmath import exp

TWO_SIDED_95 = 1.96

_MOST_STEPS = 20  # 4 to 6 are enough
_CLOSE = 1e-6  # of the width: the next step would be its square
_PER_SQRT_TWO_PI = 0.3989422804014327


@njit(cache=True, error_model="numpy")
def half_width(normal: float, even: float) -> float:
    """Return what a sum of two errors stays within in 95 % of cases.

    One is normal with the standard deviation `normal`, the other uniform within +- `even`.
    """
    if even <= 1e-4 * normal:  # 1e-9 of the width, and what follows would be lost in rounding
        return TWO_SIDED_95 * normal
    if normal <= 1e-3 * even:
        return 0.95 * even
    # Each error alone stays within less than their sum does (Anderson 1955). The share within rises ever more slowly
    # with the width, so that Newton's steps from below never pass the root.
    width = max(0.95 * even, TWO_SIDED_95 * normal)
    for _ in range(_MOST_STEPS):
        above, below = (width + even) / normal, (width - even) / normal
        # The share within is the mean, over the even error, of the normal one's: an integral that has a closed form.
        share = (_integral(above) - _integral(below)) * normal / even - 1.0
        step = (0.95 - share) * even / (share_below(above) - share_below(below))
        width += step
        if step <= _CLOSE * width:
            break
    return width


def combined(evens: Sequence[float], normal: float = 0.0) -> float:
    """Return the 95 % half width of a sum of independent errors.

    Each of `evens` is uniform within its bounds; `normal` is a standard deviation. The widest of `evens` keeps
    its shape: alone, it stays within 0.95 of its bound, which is 1.65 standard deviations and not 1.96. The others join
    the normal part by their variances, bound^2 / 3 (JCGM 100:2008, 4.3.7, 5.1.2 and G.1.4).
    """
    ordered = sorted(evens, reverse=True)
    variance = normal * normal + sum(even * even / 3.0 for even in ordered[1:])
    return half_width(math.sqrt(variance), ordered[0] if ordered else 0.0)


@njit(cache=True, error_model="numpy")
def _integral(x: float) -> float:
    """Return the integral of the normal distribution's function up to x."""
    return x * share_below(x) + _PER_SQRT_TWO_PI * exp(-0.5 * x * x)


@njit(cache=True, error_model="numpy")
def share_below(x: float) -> float:
    """Return the standard normal distribution's function, within 1e-7.

    The approximation is that of Abramowitz and Stegun 1964, 26.2.17.
    """
    t = 1.0 / (1.0 + 0.2316419 * abs(x))
    series = t * (0.319381530 + t * (-0.356563782 + t * (1.781477937 + t * (-1.821255978 + t * 1.330274429))))
    above = _PER_SQRT_TWO_PI * exp(-0.5 * x * x) * series
    return 1.0 - above if x >= 0.0 else above
