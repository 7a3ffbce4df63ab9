"""Fit unknowns of a model to a record, for the largest posterior.

Disturbances fall while the likelihood grows.

Beside the Gaussian prior a steep wall stands at each tolerance, or an inertia that is 30 % off would be swallowed. The
disturbances start large and fall by a decade a round, refitted in between: with small ones from the start a wrong model
locks the filter out, with large ones nothing is visible.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.estimation.filtering import Disturbance, Filtered, Noise, Normal, filtered, sensitivities
from etb_hil.estimation.kalman import JITTER
from etb_hil.estimation.record import Record
from etb_hil.estimation.unknown import Unknown
from etb_hil.plant.physics import COULOMB, STICTION, STOP_HIGH, STOP_LOW
from etb_hil.recording.samples import Float64

# Disturbances at the start of a fit: torque as a share of T_c and voltage in V. Large, or a wrong model locks the
# filter out (Kristensen, Madsen and Jorgensen 2004); with ten times as much nothing is visible.
_FIRST = (0.1, 0.3)
# And the least: a thousandth of what the sensors of the project's data sheets can show.
_LEAST = (1e-5, 1e-4)
_LOWERED = 10.0  # ratio of two disturbances that are tried; the likelihood does not resolve less
# Gauss-Newton steps with damping (Levenberg 1944, Marquardt 1963): most of a fit, and gain in nats that ends it.
_STEPS, _SETTLED = 8, 1.0
# Share of what a fit is behind another that a step has to gain: `_STEPS` smaller ones come nowhere near it. With 0 the
# same hypotheses are excluded, in twice the passes (`python benchmarks/unit_faults.py`).
_NEARER = 0.02
# Places of each stop that are tried over its tolerance: before it is met, no slope leads there.
_STOPS_TRIED = 6
# Standard deviation of the logarithm of a variance of noise: a data sheet is off by a factor of two in amplitude.
_NOISE = 2.0 * math.log(2.0)
_NOISE_STEP = 2.0  # factor between variances of noise that are tried
_OF_DISTURBANCES = (0, 1)  # places of their variances before those of the noise
_ROUNDS = 20  # of variances and unknowns in turn, at most: 11 fits of a friction check took 30
_WALL = 0.02  # of a tolerance: standard deviation of the wall beyond it
# Newton steps to the largest posterior of a linear model: weight of a distance beyond a bound, in the prior's standard
# deviations; steps at most (each crosses a wall or is the last); gain in nats that ends them; Armijo's share of the
# slope; and the shortest part of a step that is tried.
_HARD, _NEWTON, _FLAT, _ARMIJO, _SHORTEST = 1e4, 50, 1e-3, 0.1, 1e-6
_FARTHEST = 3.0  # standard deviations that an unknown moves at a time
_DAMPED = (1e-3, 1e-6, 1e3)  # damping at the start, least, and that of a step which is not worth its pass


@dataclass(frozen=True, slots=True)
class Fitted:
    """A model at its largest posterior.

    `posterior`: log-likelihood and log-prior, in nats. `normal`: of the unknowns, in units of their parameters, without
    the prior.
    """

    parameters: Float64
    unknowns: tuple[Unknown, ...]
    disturbance: Disturbance
    posterior: float
    filtered: Filtered
    normal: Normal

    @property
    def covariance(self) -> Float64:
        """Posterior covariance of the unknowns (c, c), by Laplace's approximation.

        Entries are in the units of the unknowns.
        """
        scale = _scale(self.unknowns)
        return np.asarray(np.linalg.inv(self._curved) * np.outer(scale, scale))

    def value(self, name: str) -> tuple[float, float]:
        """Return an unknown's value and its standard deviation, by its name.

        KeyError where there is none.
        """
        for k, one in enumerate(self.unknowns):
            if one.name == name:
                return float(self.parameters[one.place]), float(np.sqrt(self.covariance[k, k]))
        raise KeyError(name)

    @property
    def evidence(self) -> float:
        """Laplace's approximation of the logarithm of the evidence, in nats."""
        return self.posterior - 0.5 * float(np.linalg.slogdet(self._curved)[1])

    @property
    def _curved(self) -> Float64:
        """The posterior's curvature (c, c) in units of the prior's standard deviations."""
        scale = _scale(self.unknowns)
        _, bends = prior_slope(self.parameters, self.unknowns)
        return self.normal.matrix * np.outer(scale, scale) + np.diag(bends)


def prior_slope(parameters: Float64, unknowns: Sequence[Unknown]) -> tuple[Float64, Float64]:
    """Return slope and curvature (c) of the logarithm of the prior.

    Both are in units of the prior's standard deviations.
    """
    away = np.array([parameters[one.place] - one.mean for one in unknowns])
    scale, reach = _scale(unknowns), np.array([one.reach for one in unknowns])
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
    return -0.5 * float(np.sum((away / _scale(unknowns)) ** 2) + np.sum(over(parameters, unknowns) ** 2))


def best_step(
    parameters: Float64,
    unknowns: Sequence[Unknown],
    matrix: Float64,
    gradient: Float64,
    damping: float = 0.0,
    farthest: float = _FARTHEST,
) -> tuple[Float64, float]:
    """Return the step (c) to the largest posterior of a linear model, and its gain.

    `matrix` (c, c) and `gradient` (c): of the likelihood. The step is in units of the prior's standard deviations. The
    likelihood is a parabola, but walls and bounds are taken as they are: a parabola of the prior would know of a wall
    only beyond it. The function is convex and made of parabolas, so that Newton steps with a line search find its
    maximum.
    """
    scale = _scale(unknowns)
    mean, reach, low, high = (
        np.array([getattr(one, name) for one in unknowns]) / scale for name in ("mean", "reach", "low", "high")
    )
    at = np.array([parameters[one.place] for one in unknowns]) / scale - mean
    curved = matrix * np.outer(scale, scale)
    curved += damping * np.diag(np.diag(curved) + 1.0)
    slope = -gradient * scale
    wall = np.where(np.isfinite(reach), 1.0 / (_WALL * np.where(np.isfinite(reach), reach, 1.0)), 0.0)
    hard = np.full(len(at), _HARD)
    limits = [(-reach, reach, wall), (low - mean, high - mean, hard), (at - farthest, at + farthest, hard)]

    def cost(step: Float64) -> float:
        x = at + step
        found = -slope @ step + 0.5 * step @ curved @ step + 0.5 * x @ x
        for least, most, weight in limits:
            beyond = np.maximum(least - x, 0.0) + np.maximum(x - most, 0.0)
            found += 0.5 * float(np.sum((weight * beyond) ** 2))
        return float(found)

    step = np.zeros(len(at))
    first = now = cost(step)
    for _ in range(_NEWTON):
        x = at + step
        pull, bends = -x, np.ones(len(x))
        for least, most, weight in limits:
            beyond = np.minimum(x - least, 0.0) + np.maximum(x - most, 0.0)
            pull -= weight**2 * beyond
            bends += np.where(beyond != 0.0, weight**2, 0.0)
        push = slope - curved @ step + pull
        way = np.linalg.solve(curved + np.diag(bends), push)
        rises, by = float(push @ way), 1.0
        if rises < _FLAT:
            break
        while (then := cost(step + by * way)) > now - _ARMIJO * by * rises and by > _SHORTEST:
            by *= 0.5
        step, now = step + by * way, then
    return step, first - now


def climbed(
    record: Record,
    parameters: Float64,
    unknowns: Sequence[Unknown],
    disturbance: Disturbance,
    steps: int = _STEPS,
    settled: float = _SETTLED,
    aim: float = -np.inf,
) -> Fitted:
    """Return the largest posterior near some parameters at one disturbance.

    `aim` is a posterior that is known to be reached by others: a fit far below it ends at steps that come no nearer.
    """
    columns = [one.column() for one in unknowns]
    at = filtered(record, parameters, disturbance, is_kept=True)
    normal = sensitivities(record, at, columns)
    best = Fitted(parameters, tuple(unknowns), disturbance, _posterior(at, parameters, unknowns), at, normal)
    damping = _DAMPED[0]
    for _ in range(steps):
        least = max(settled, _NEARER * (aim - best.posterior))
        before = best.posterior
        while damping <= _DAMPED[2]:
            step, gain = best_step(best.parameters, unknowns, best.normal.matrix, best.normal.gradient, damping)
            if 2.0 * gain < least:
                return best
            moved = _moved(best.parameters, unknowns, step)
            at = filtered(record, moved, disturbance, is_kept=True)
            found = _posterior(at, moved, unknowns)
            if found > before:
                break
            damping = max(10.0 * damping, 10.0 * _DAMPED[0])
        else:
            return best
        normal = sensitivities(record, at, columns)
        best = Fitted(moved, tuple(unknowns), disturbance, found, at, normal)
        damping = max(0.1 * damping, _DAMPED[1])
        if found - before < least:
            break
    return best


def settled(record: Record, fit: Fitted, aim: float = -np.inf) -> Fitted:
    """Return a fit with its own disturbances and noise; `aim` as in `climbed`.

    Their variances and the unknowns are fitted in turn. Where an unknown and a disturbance have nearly the same effect,
    neither moves far that way: in the end the unknowns are fitted with smaller disturbances, as long as the posterior
    grows.
    """
    fit = in_turn(record, fit, aim)
    while (lower := _lower(fit)) != fit.disturbance:
        found = climbed(record, fit.parameters, fit.unknowns, lower, aim=aim)
        least = max(_SETTLED, _NEARER * (aim - fit.posterior))
        if found.posterior < fit.posterior + least:
            break
        fit = in_turn(record, found, aim)
    return fit


def in_turn(record: Record, fit: Fitted, aim: float = -np.inf, rounds: int = _ROUNDS) -> Fitted:
    """Return a fit of variances and unknowns in turn, as long as the posterior grows.

    That takes `rounds` at most; `aim` as in `climbed`. A variance of noise that does not change in one round is kept
    until the others have settled.
    """
    places = every = tuple(range(len(_variances(fit.disturbance))))
    for _ in range(rounds):
        least = max(_SETTLED, _NEARER * (aim - fit.posterior))
        disturbance, gains = _with_variances(record, fit, places)
        if gains < least and places != every:
            places = every
            disturbance, gains = _with_variances(record, fit, places)
        if gains < least:
            return fit
        before, now = _variances(fit.disturbance), _variances(disturbance)
        places = tuple(k for k in places if k in _OF_DISTURBANCES or now[k] != before[k])
        found = climbed(record, fit.parameters, fit.unknowns, disturbance, aim=aim)
        if found.posterior < fit.posterior + least:
            return max(fit, found, key=lambda one: one.posterior)
        fit = found
    return fit


def _lower(fit: Fitted) -> Disturbance:
    """Return a fit's disturbances a decade lower, where they are not at their least."""
    torque, voltage = (
        max(one / _LOWERED, least)
        for one, least in zip((fit.disturbance.torque, fit.disturbance.voltage), _least(fit), strict=True)
    )
    return replace(fit.disturbance, torque=torque, voltage=voltage)


def _least(fit: Fitted) -> tuple[float, float]:
    """Return the least disturbances, in N·m and in V."""
    return _LEAST[0] * float(fit.parameters[COULOMB]), _LEAST[1]


def calibrated(record: Record, parameters: Float64, unknowns: Sequence[Unknown]) -> Fitted:
    """Return the fit of base parameters, from as far off as their tolerances allow."""
    first = Disturbance(_FIRST[0] * parameters[COULOMB], _FIRST[1])
    p = _at_stops(record, parameters, unknowns, first)
    fit = climbed(record, p, unknowns, first, settled=100.0 * _SETTLED)
    return settled(record, fit)


def _with_variances(record: Record, fit: Fitted, places: Sequence[int]) -> tuple[Disturbance, float]:
    """Return a fit's disturbances with the likeliest variances, and the gain in nats.

    Each variance is fitted by a parabola through the logarithm of the posterior, one after the other. They are those of
    the record itself: a part of it has others, and the fit would stop between the two.
    """
    known: dict[tuple[float, ...], float] = {}

    def posterior(disturbance: Disturbance) -> float:
        variances = _variances(disturbance)
        if variances not in known:
            likelihood = filtered(record, fit.parameters, disturbance).log_likelihood
            known[variances] = likelihood + _log_prior_of_noise(disturbance.noise)
        return known[variances]

    first = known[_variances(fit.disturbance)] = fit.posterior - log_prior(fit.parameters, fit.unknowns)
    best, found = fit.disturbance, first
    bounds = _bounds(record, fit)
    for k in places:
        factor, least, most = bounds[k]
        at = _variances(best)[k]
        low, high = (_with(best, k, min(max(at * by, least), most)) for by in (1.0 / factor, factor))
        at_low, at_high = posterior(low), posterior(high)
        bends = 2.0 * found - at_low - at_high
        rises = 0.5 * (at_high - at_low)
        by = rises / bends if bends > 0.0 else math.copysign(2.0, rises)
        if at in (least, most) and found >= max(at_low, at_high):
            continue
        tried = _with(best, k, min(max(at * factor ** min(max(by, -2.0), 2.0), least), most))
        all_of_them = ((found, best), (at_low, low), (at_high, high), (posterior(tried), tried))
        found, best = max(all_of_them, key=lambda one: one[0])
    return best, found - first


def _variances(disturbance: Disturbance) -> tuple[float, ...]:
    return (disturbance.torque**2, disturbance.voltage**2, *disturbance.noise)


def _with(disturbance: Disturbance, k: int, variance: float) -> Disturbance:
    """Return disturbances with another variance in one place."""
    found = list(_variances(disturbance))
    found[k] = variance
    return Disturbance(math.sqrt(found[0]), math.sqrt(found[1]), Noise(*found[2:]))


def _bounds(record: Record, fit: Fitted) -> list[tuple[float, float, float]]:
    """Return how each variance is searched: a factor, its least and its most.

    Variances that are tried differ by the factor. Disturbances fall by a decade at a time. A sensor may have more noise
    than its data sheet states: what an unmodelled effect adds to its readings. Else a disturbance would be needed for
    that. A stamp is off by what is uniform within a sample, at most.
    """
    found = []
    for one, least in zip((fit.disturbance.torque, fit.disturbance.voltage), _least(fit), strict=True):
        found.append((_LOWERED, max(one / _LOWERED, least) ** 2, (one * _LOWERED) ** 2))
    return [
        *found,
        *[(_NOISE_STEP, 1e-6, np.inf)] * (len(fit.disturbance.noise) - 1),
        (_NOISE_STEP, 1e-6, _most_jitter(record)),
    ]


def _most_jitter(record: Record) -> float:
    """Return the largest variance of a clock's jitter, in multiples of the assumed."""
    return float(np.median(record.dt) ** 2 / 12.0 / record.settings[JITTER] ** 2)


def _log_prior_of_noise(noise: Sequence[float]) -> float:
    return -0.5 * sum((math.log(one) / _NOISE) ** 2 for one in noise)


def _at_stops(record: Record, parameters: Float64, unknowns: Sequence[Unknown], first: Disturbance) -> Float64:
    """Return parameters with the likeliest stops of some within tolerances."""
    p = parameters
    for one in unknowns:
        if one.place in (STOP_LOW, STOP_HIGH):
            tried = [
                _replaced(p, one.place, one.mean + share * one.reach) for share in np.linspace(-1, 1, _STOPS_TRIED)
            ]
            p = max(tried, key=lambda q: filtered(record, q, first).log_likelihood)
    return p


def _replaced(parameters: Float64, place: int, value: float) -> Float64:
    """Return parameters with another value at one place."""
    found = parameters.copy()
    found[place] = value
    return found


def _posterior(at: Filtered, parameters: Float64, unknowns: Sequence[Unknown]) -> float:
    return at.log_likelihood + log_prior(parameters, unknowns) + _log_prior_of_noise(at.disturbance.noise)


def _scale(unknowns: Sequence[Unknown]) -> Float64:
    return np.array([one.deviation for one in unknowns])


def _moved(parameters: Float64, unknowns: Sequence[Unknown], step: Float64) -> Float64:
    p = parameters.copy()
    for one, moves in zip(unknowns, step, strict=True):
        one.put(p, float(np.clip(p[one.place] + moves * one.deviation, one.low, one.high)))
    p[STICTION] = max(p[STICTION], p[COULOMB])
    return p
