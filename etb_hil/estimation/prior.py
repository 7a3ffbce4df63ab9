"""The prior of unknowns, and the best step by a linear model under it.

Beside the Gaussian prior a steep wall stands at each tolerance, or an inertia that is 30 % off would be swallowed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.estimation.unknown import Unknown
from etb_hil.recording.samples import Float64

_WALL = 0.02  # of a tolerance: standard deviation of the wall beyond it
# Newton steps to the largest posterior of a linear model: weight of a distance beyond a bound, in the prior's standard
# deviations; steps at most (each crosses a wall or is the last); gain in nats that ends them; Armijo's share of the
# slope; and the shortest part of a step that is tried.
_HARD, _NEWTON, _FLAT, _ARMIJO, _SHORTEST = 1e4, 50, 1e-3, 0.1, 1e-6
_FARTHEST = 3.0  # standard deviations that an unknown moves at a time


def prior_slope(parameters: Float64, unknowns: Sequence[Unknown]) -> tuple[Float64, Float64]:
    """Return slope and curvature (c) of the logarithm of the prior.

    Both are in units of the prior's standard deviations.
    """
    away = np.array([parameters[one.place] - one.mean for one in unknowns])
    scale, reach = scales(unknowns), np.array([one.reach for one in unknowns])
    wall = np.where(np.isfinite(reach), scale / (_WALL * np.where(np.isfinite(reach), reach, 1.0)), 0.0)
    over = np.where(np.isfinite(reach), np.sign(away) * np.maximum(np.abs(away) - reach, 0.0), 0.0) / scale
    return -away / scale - over * wall**2, 1.0 + np.where(over != 0.0, wall**2, 0.0)


def over(parameters: Float64, unknowns: Sequence[Unknown]) -> Float64:
    """Return how far unknowns are beyond their tolerances (c).

    Distances are in standard deviations of the wall.
    """
    away = np.array([abs(parameters[one.place] - one.mean) for one in unknowns])
    reach = np.array([one.reach for one in unknowns])
    known = np.isfinite(reach)
    return np.where(known, np.maximum(away - reach, 0.0) / (_WALL * np.where(known, reach, 1.0)), 0.0)


def log_prior(parameters: Float64, unknowns: Sequence[Unknown]) -> float:
    """Return the logarithm of the prior, 0 at its mean."""
    away = np.array([parameters[one.place] - one.mean for one in unknowns])
    return -0.5 * float(np.sum((away / scales(unknowns)) ** 2) + np.sum(over(parameters, unknowns) ** 2))


def best_step(
    values: Float64,
    unknowns: Sequence[Unknown],
    matrix: Float64,
    gradient: Float64,
    damping: float = 0.0,
    farthest: float = _FARTHEST,
) -> tuple[Float64, float]:
    """Return the step (c) to the largest posterior of a linear model, and its gain.

    `values` (c): of the unknowns; `matrix` (c, c) and `gradient` (c): of the likelihood. The step is in units of the
    prior's standard deviations. The likelihood is a parabola, but walls and bounds are taken as they are: a parabola of
    the prior would know of a wall only beyond it. The function is convex and made of parabolas, so that Newton steps
    with a line search find its maximum.
    """
    scale = scales(unknowns)
    mean, reach, low, high = (
        np.array([getattr(one, name) for one in unknowns]) / scale for name in ("mean", "reach", "low", "high")
    )
    at = values / scale - mean
    curved = matrix * np.outer(scale, scale)
    curved += damping * np.diag(np.diag(curved) + 1.0)
    slope = -gradient * scale
    wall = np.where(np.isfinite(reach), 1.0 / (_WALL * np.where(np.isfinite(reach), reach, 1.0)), 0.0)
    hard = np.full(len(at), _HARD)
    # Tolerance, bounds, and the farthest that an unknown moves at a time: a row each.
    least, most = np.array([-reach, low - mean, at - farthest]), np.array([reach, high - mean, at + farthest])
    stiff = np.array([wall, hard, hard]) ** 2

    def beyond(x: Float64) -> Float64:
        return np.minimum(x - least, 0.0) + np.maximum(x - most, 0.0)

    def cost(step: Float64) -> float:
        x = at + step
        return float(-slope @ step + 0.5 * (step @ curved @ step + x @ x + np.sum(stiff * beyond(x) ** 2)))

    step = np.zeros(len(at))
    first = now = cost(step)
    for _ in range(_NEWTON):
        x = at + step
        away = beyond(x)
        pull, bends = -x - np.sum(stiff * away, axis=0), 1.0 + np.sum(np.where(away != 0.0, stiff, 0.0), axis=0)
        push = slope - curved @ step + pull
        way = np.linalg.solve(curved + np.diag(bends), push)
        rises, by = float(push @ way), 1.0
        if rises < _FLAT:
            break
        while (then := cost(step + by * way)) > now - _ARMIJO * by * rises and by > _SHORTEST:
            by *= 0.5
        step, now = step + by * way, then
    return step, first - now


def scales(unknowns: Sequence[Unknown]) -> Float64:
    """Return the standard deviations (c) of the prior."""
    return np.array([one.deviation for one in unknowns])
