"""Transcendental functions made of `+ - * /` and comparisons only: the same bits on every x86-64 machine.

The C library's `exp` differs between versions and processors in its last bit, and a verdict that is replayed elsewhere
must not. The range is reduced with ln 2 in two parts; on what is left, exp(r) = 1 + 2 r / (r coth(r/2) - r) with the
Bernoulli series of r coth(r/2) (Abramowitz and Stegun 1964, 4.5.67).
"""

from __future__ import annotations

import numpy as np
from numba import njit

_INVERSE_LN2 = 1.4426950408889634
# The first part of ln 2 ends in 21 zero bits, so that k times it is exact for every k that a double can scale by.
_LN2_HIGH = float.fromhex("0x1.62e42fee00000p-1")
_LN2_LOW = float.fromhex("0x1.a39ef35793c76p-33")
# 2 B(2n) / (2n)! for n = 1 ... 6
_B1 = 1.0 / 6.0
_B2 = -1.0 / 360.0
_B3 = 1.0 / 15120.0
_B4 = -1.0 / 604800.0
_B5 = 1.0 / 23950080.0
_B6 = -691.0 / 653837184000.0

_EXP_OVERFLOW = 709.782712893384
_EXP_UNDERFLOW = -745.2
_SUBNORMAL = -1021


@njit(cache=True, error_model="numpy", inline="always")
def _power_of_two(k: np.int64) -> float:
    """Return 2**k for -1022 <= k <= 1023, put together from its bits."""
    return np.int64((k + 1023) << 52).view(np.float64)


@njit(cache=True, error_model="numpy")
def exp(x: float) -> float:
    """Return e**x within 1 ulp (2 ulp where the result is subnormal); inf and 0 beyond what a double holds."""
    if not x <= _EXP_OVERFLOW:
        return x if x != x else np.inf  # noqa: PLR0124 (the test for NaN that needs no library)
    if x < _EXP_UNDERFLOW:
        return 0.0
    k = np.int64(x * _INVERSE_LN2 + (0.5 if x >= 0.0 else -0.5))
    high = x - k * _LN2_HIGH
    low = k * _LN2_LOW
    r = high - low
    s = r * r
    c = r - s * (_B1 + s * (_B2 + s * (_B3 + s * (_B4 + s * (_B5 + s * _B6)))))
    y = 1.0 - ((low - (r * c) / (2.0 - c)) - high)
    if k < _SUBNORMAL:
        return y * _power_of_two(k + 100) * _power_of_two(np.int64(-100))
    if k > 1023:
        return y * 2.0 * _power_of_two(k - 1)
    return y * _power_of_two(k)


@njit(cache=True, error_model="numpy")
def exp_neg(y: float) -> float:
    """Return e**-y, y >= 0, within 1 ulp."""
    return exp(-y)
