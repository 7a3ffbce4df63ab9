"""Velocity from an angle: the robust exact differentiator of Levant (1998), compiled."""

from __future__ import annotations

import math

from numba import njit

# Levant (1998), section 4: gains that converge for any signal whose second derivative stays within the bound.
_PROPORTIONAL = 1.5
_INTEGRAL = 1.1


@njit(cache=True, error_model="numpy", inline="always")
def reaches(dt: float, bound: float) -> tuple[float, float]:
    """Return what `differentiate` needs of a step of dt in s, where acceleration stays within `bound` rad/s^2."""
    return dt * dt * _INTEGRAL * bound, dt * _PROPORTIONAL * math.sqrt(bound)


@njit(cache=True, error_model="numpy", inline="always")
def differentiate(
    angle: float, velocity: float, measured: float, dt: float, per_dt: float, near: float, slope: float
) -> tuple[float, float]:
    """Move an estimate (angle in rad, velocity in rad/s) by dt in s (`per_dt` its inverse) towards a measured angle.

    `near` and `slope` are those of `reaches`. The sign is taken at the end of the step (implicit discretisation,
    Acary and Brogliato 2010), which solves for the error that is left: no chattering about an exact signal.
    """
    away = measured - (angle + dt * velocity)
    size = abs(away)
    if size <= near:
        return measured, velocity + away * per_dt
    sign = 1.0 if away > 0.0 else -1.0
    root = 0.5 * (math.sqrt(slope * slope + 4.0 * (size - near)) - slope)
    return measured - sign * (root * root), velocity + sign * (near * per_dt)
