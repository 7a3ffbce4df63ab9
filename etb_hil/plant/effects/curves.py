"""Curves that effects share: one formula for the several forms that are in use."""

from __future__ import annotations

import math

from etb_hil.base.compiled import njit

_EXPONENTIAL = 1e-4  # a tail below it is none
_SINE = 1e-6  # a pointedness below it is none


@njit(cache=True, error_model="numpy")
def bell(x: float, steepness: float, tail: float) -> float:
    """Return a curve that is one at 0 and falls with abs(x).

    The curve is (1 + t y)^(-1/t), y = abs(x)^m (Tsallis 1988).

    A tail t of 0 is exp(-y), a bell with m = 2; 1 with m = 2 is Lorentz' curve. Below 0 the curve ends at a place: -1
    with m = 1 is a triangle.
    """
    y = abs(x) ** steepness if x != 0.0 else 0.0
    if abs(tail) < _EXPONENTIAL:
        return math.exp(-y)
    inside = 1.0 + tail * y
    return inside ** (-1.0 / tail) if inside > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def halved(x: float, steepness: float, tail: float) -> float:
    """Return the same curve over half its width.

    The curve is a half at 1 whatever its steepness and its tail.
    """
    half = math.log(2.0) if abs(tail) < _EXPONENTIAL else (2.0**tail - 1.0) / tail
    return bell(x * half ** (1.0 / steepness), steepness, tail)


@njit(cache=True, error_model="numpy")
def side(x: float, lag: float) -> float:
    """Return an odd curve from -1 to 1.

    The curve is tanh(x) with a lag of 0, x / (1 + abs(x)) with 1, a line cut off with -1.

    Cubic in the lag between them, nearly in proportion above 0: without a bend at 0 a fit finds either way from there.
    """
    settled = math.tanh(x)
    if lag == 0.0:
        return settled
    later, sooner = x / (1.0 + abs(x)) - settled, min(max(x, -1.0), 1.0) - settled
    found = settled + 0.25 * lag * ((3.0 - lag) * (1.0 + lag) * later - (1.0 - lag) ** 2 * sooner)
    return min(max(found, -1.0), 1.0)


@njit(cache=True, error_model="numpy")
def pointed(sine: float, pointedness: float) -> float:
    """Return a sine from -1 to 1 as another wave.

    The wave is a triangle with a pointedness of 1, and below 0 ever flatter on top.
    """
    if abs(pointedness) < _SINE:
        return sine
    root = math.sqrt(abs(pointedness))
    if pointedness < 0.0:
        return math.asinh(root * sine) / math.asinh(root)
    return math.asin(min(max(root * sine, -1.0), 1.0)) / math.asin(min(root, 1.0))


@njit(cache=True, error_model="numpy")
def wave(phase: float, sine: float, cosine: float, pointedness: float, sine_2: float, cosine_2: float) -> float:
    """Return a wave at a phase in rad.

    The wave has sizes of sine and cosine (not both 0), a form, and sizes of the double order.
    """
    s, c = math.sin(phase), math.cos(phase)
    found = sine * s + cosine * c
    if pointedness != 0.0:
        size = math.hypot(sine, cosine)
        found = size * pointed(found / size, pointedness)
    if sine_2 == 0.0 and cosine_2 == 0.0:
        return found
    return found + 2.0 * sine_2 * s * c + cosine_2 * (1.0 - 2.0 * s * s)


@njit(cache=True, error_model="numpy")
def lagged(before: float, end: float, dt: float, time_constant: float) -> float:
    """Return a first-order lag's state dt s later, towards a constant end.

    The time constant is in s.
    """
    return end + (before - end) * math.exp(-dt / time_constant)
