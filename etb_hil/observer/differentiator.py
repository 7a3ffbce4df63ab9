"""Velocity from an angle: the differentiator of Levant (1998), compiled.

The differentiator is the robust exact one.

In units of its own reach and of a step of time it has no gains left that change: nothing is multiplied where each
sample waits for the one before.
"""

from __future__ import annotations

import math

from etb_hil.base.compiled import njit

# Levant (1998), section 4: gains that converge for any signal whose second derivative stays within the bound.
_PROPORTIONAL = 1.5
_INTEGRAL = 1.1

_NEAR = _INTEGRAL / _PROPORTIONAL**2  # the error that one step makes up for, in units of the reach
_QUARTER = 0.25  # the square of half the root's slope, likewise


@njit(cache=True, error_model="numpy", inline="always")
def reach(dt: float, bound: float) -> float:
    """Return the unit in rad of what `differentiate` takes, at steps of dt in s.

    What it gives is in the same unit.

    `bound` rad/s^2 that the acceleration stays within.
    """
    slope = _PROPORTIONAL * dt
    return slope * slope * bound


@njit(cache=True, error_model="numpy", inline="always")
def differentiate(away: float) -> tuple[float, float, float]:
    """Return the error that is left, and the change of the way per step.

    The error comes in two parts, first less second.

    `away` is how far the measured angle is from the predicted one; all in units of `reach`. The sign is taken at the
    end of the step (implicit discretisation, Acary and Brogliato 2010), which solves for the error that is left: no
    chattering about an exact signal. Near zero it is exactly zero, where no step waits for a root: that is worth a
    branch, even one that noise makes a processor guess wrongly. In two parts, because the next step has other things to
    add up while it waits for the root in the second.
    """
    size = abs(away)
    if size <= _NEAR:
        return 0.0, 0.0, away
    under = size - (_NEAR - _QUARTER)
    # (root - 1/2)^2 = (under + 1/4) - root
    return math.copysign(under + _QUARTER, away), math.copysign(math.sqrt(under), away), math.copysign(_NEAR, away)
