"""Velocity from an angle: the robust exact differentiator of Levant (1998), compiled."""

from __future__ import annotations

import math

from numba import njit

# Levant (1998), section 4: gains that converge for any signal whose second derivative stays within the bound.
_PROPORTIONAL = 1.5
_INTEGRAL = 1.1


@njit(cache=True, error_model="numpy", inline="always")
def reaches(dt: float, bound: float) -> tuple[float, float, float]:
    """Return what `differentiate` needs of a step of dt in s, where acceleration stays within `bound` rad/s^2.

    The error that one step makes up for, half the slope of the root's law, and its square, as they enter there.
    """
    half = 0.5 * dt * _PROPORTIONAL * math.sqrt(bound)
    return dt * dt * _INTEGRAL * bound, half, half * half


@njit(cache=True, error_model="numpy", inline="always")
def differentiate(away: float, per_dt: float, near: float, half: float, square: float) -> tuple[float, float, float]:
    """Return the error that is left in rad, in two parts, first less second, and a change of velocity in rad/s.

    `away` is how far the measured angle is from the predicted one; `per_dt` the inverse of the step in s; `near`,
    `half` and `square` are those of `reaches`. The sign is taken at the end of the step (implicit discretisation, Acary
    and Brogliato 2010), which solves for the error that is left: no chattering about an exact signal. Within `near` it
    is exactly zero, where no step waits for a root: that is worth a branch, even one that noise makes a processor guess
    wrongly. In two parts, because the next step has other things to add up while it waits for the root in the second.
    """
    size = abs(away)
    if size <= near:
        made_up = math.copysign(square + square, away)
        return made_up, made_up, away * per_dt
    under = size - (near - square)
    # (root - half)^2 = (under + square) - 2 half root
    return (
        math.copysign(under + square, away),
        math.copysign(half + half, away) * math.sqrt(under),
        math.copysign(near * per_dt, away),
    )
