"""Transcendental functions made of `+ - * /` and comparisons only.

They give the same bits on every x86-64 machine.

The C library's `exp` differs between versions and processors in its last bit, and a verdict that is replayed elsewhere
must not. The range is reduced with ln 2 in two parts; on the residual, exp(r) = 1 + 2 r / (r coth(r/2) - r) with the
Bernoulli series of r coth(r/2) (Abramowitz and Stegun 1964, 4.5.67).
"""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.compiled import njit

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

# The first part of pi / 2 ends in 20 zero bits: up to 2^20 times it is exact.
_QUARTERS = 0.6366197723675814
_QUARTER_HIGH = float.fromhex("0x1.921fb54400000p+0")
_QUARTER_LOW = float.fromhex("0x1.0b4611a626331p-34")
_TERMS = 9  # (pi / 4)^20 / 20! is below 1e-20

_NEAR = 0.125
_GAUSS_STEPS = 64  # in the table, a unit of its argument
_GAUSS_ENDS = 6.5  # beyond it e**-x^2 is below 1e-18


def _gauss_table() -> NDArray[np.float64]:
    """Return e**-x^2 on the grid, correctly rounded.

    `decimal` does not depend on the machine.
    """
    with localcontext(prec=30):
        exact = [(-((Decimal(j) / _GAUSS_STEPS) ** 2)).exp() for j in range(int(_GAUSS_ENDS * _GAUSS_STEPS) + 2)]
    return np.array([float(value) for value in exact])


_GAUSS = _gauss_table()

_EXP_OVERFLOW = 709.782712893384
_EXP_UNDERFLOW = -745.2
_SUBNORMAL = -1021
_MANTISSA, _ONE_BITS = np.int64(0x000FFFFFFFFFFFFF), np.int64(0x3FF0000000000000)
_SMALLEST_NORMAL, _TWO_54 = 2.0**-1022, 2.0**54
_SQRT_2 = 1.4142135623730951


@njit(cache=True, error_model="numpy", inline="always")
def _power_of_two(k: np.int64) -> float:
    """Return 2**k for -1022 <= k <= 1023, put together from its bits."""
    return np.int64((k + 1023) << 52).view(np.float64)


@njit(cache=True, error_model="numpy", forceinline=True)
def exp(x: float) -> float:
    """Return e**x within 1 ulp (2 ulp where the result is subnormal).

    The result is inf and 0 beyond what a double holds.
    """
    if not x <= _EXP_OVERFLOW:
        return x if x != x else np.inf  # noqa: PLR0124 (the test for NaN that needs no library)
    if x < _EXP_UNDERFLOW:
        return 0.0
    k = np.int64(x * _INVERSE_LN2 + (0.5 if x >= 0.0 else -0.5))
    high = x - k * _LN2_HIGH
    low = k * _LN2_LOW
    r = high - low
    s = r * r
    # Pairs first: half the latency of Horner's rule, in the innermost loop of the plant.
    q = s * s
    c = r - s * ((_B1 + s * _B2) + q * ((_B3 + s * _B4) + q * (_B5 + s * _B6)))
    y = 1.0 - ((low - (r * c) / (2.0 - c)) - high)
    if k < _SUBNORMAL:
        return y * _power_of_two(k + 100) * _power_of_two(np.int64(-100))
    if k > 1023:
        return y * 2.0 * _power_of_two(k - 1)
    return y * _power_of_two(k)


@njit(cache=True, error_model="numpy", forceinline=True)
def exp_neg(y: float) -> float:
    """Return e**-y, y >= 0, within 1 ulp."""
    return exp(-y)


@njit(cache=True, error_model="numpy", forceinline=True)
def _exp_small(a: float) -> float:
    """Return e**a for abs(a) < 0.13 within 2e-12 of it."""
    s = a * a
    return (
        (1.0 + a)
        + s * (1.0 / 2.0 + a * (1.0 / 6.0))
        + s * s * ((1.0 / 24.0 + a * (1.0 / 120.0)) + s * (1.0 / 720.0 + a * (1.0 / 5040.0)))
    )


@njit(cache=True, error_model="numpy")
def log(value: float) -> float:
    """Return the natural logarithm within 2 ulp; -inf of 0, NaN below.

    value = 2**k m with m about 1; log m = 2 atanh((m - 1) / (m + 1)), by its series (Abramowitz and Stegun 4.1.27).
    """
    if not (0.0 < value < np.inf):
        return -np.inf if value == 0.0 else (value if value > 0.0 else np.nan)
    k = np.int64(0)
    if value < _SMALLEST_NORMAL:
        value, k = value * _TWO_54, np.int64(-54)
    bits = np.float64(value).view(np.int64)
    k += (bits >> 52) - 1023
    m = np.int64((bits & _MANTISSA) | _ONE_BITS).view(np.float64)
    if m > _SQRT_2:
        m, k = 0.5 * m, k + 1
    f = m - 1.0
    s = f / (m + 1.0)
    z = s * s
    series = 1.0 / 23.0
    for n in range(10, 0, -1):
        series = 1.0 / (2 * n + 1) + z * series
    # 2 s = f - s f, of which f is exact
    return k * _LN2_HIGH + (f - (s * (f - 2.0 * z * series) - k * _LN2_LOW))


@njit(cache=True, error_model="numpy", forceinline=True)
def gauss(x: float) -> float:
    """Return e**-x^2 within 4e-16 of the true value, 0 for abs(x) > 6.5.

    The function is three times as fast as by `exp`.
    """
    x = abs(x)
    if not x <= _GAUSS_ENDS:
        return x if x != x else 0.0  # noqa: PLR0124 (the test for NaN that needs no library)
    j = np.int64(x * _GAUSS_STEPS + 0.5)
    node = j * (1.0 / _GAUSS_STEPS)
    return _GAUSS[j] * _exp_small((node - x) * (node + x))


@njit(cache=True, error_model="numpy", forceinline=True)
def gauss_near(x: float, known_x: float, known: float) -> float:
    """Return e**-x^2 from its value at a point nearby.

    The function is faster than `gauss`, within 2e-12 of `known`.
    """
    a = (known_x - x) * (known_x + x)
    return known * _exp_small(a) if abs(a) < _NEAR else gauss(x)


@njit(cache=True, error_model="numpy")
def sine_and_cosine(x: float) -> tuple[float, float]:
    """Return sin(x) and cos(x) within 4e-16, for abs(x) up to 1e5.

    The range is reduced by quarter turns, with pi / 2 in two parts; the remainder has its Taylor series.
    """
    quarters = np.floor(x * _QUARTERS + 0.5)
    a = (x - quarters * _QUARTER_HIGH) - quarters * _QUARTER_LOW
    s, sine, cosine = a * a, 0.0, 0.0
    for n in range(_TERMS, 0, -1):
        sine = (1.0 + sine) * -s / ((2 * n) * (2 * n + 1))
        cosine = (1.0 + cosine) * -s / ((2 * n - 1) * (2 * n))
    sine, cosine = a + a * sine, 1.0 + cosine
    turned = np.int64(quarters) & 3
    if turned == 1:
        return cosine, -sine
    if turned == 2:
        return -sine, -cosine
    return (-cosine, sine) if turned else (sine, cosine)


@njit(cache=True, error_model="numpy")
def sines_and_cosines(x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return sines (n) and cosines (n) of angles (n) in rad."""
    sines, cosines = np.empty(len(x)), np.empty(len(x))
    for k in range(len(x)):
        sines[k], cosines[k] = sine_and_cosine(x[k])
    return sines, cosines
