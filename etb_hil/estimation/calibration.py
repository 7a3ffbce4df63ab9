"""Fit unknowns, disturbances and noise to a record, for the largest posterior.

Beside the Gaussian prior a steep wall stands at each tolerance, or an inertia that is 30 % off would be swallowed. The
disturbances start large: with small ones from the start a wrong model locks the filter out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from etb_hil.estimation.filtering import Disturbance, Filtered, Noise, Normal, filtered
from etb_hil.estimation.kalman import JITTER, NOISE_VOLTAGE
from etb_hil.estimation.record import Record
from etb_hil.estimation.scoring import scored
from etb_hil.estimation.throttle import CURRENT, OMEGA, VOLTAGE
from etb_hil.estimation.unknown import Unknown, as_stated
from etb_hil.estimation.variances import Q_TORQUE, Q_VOLTAGE, VARIANCES
from etb_hil.plant.physics import BACK_EMF, COULOMB, INDUCTANCE, RESISTANCE, STICTION, STOP_HIGH, STOP_LOW
from etb_hil.recording.samples import Float64

# Disturbances at the start of a fit: torque as a share of T_c and voltage in V (Kristensen, Madsen and Jorgensen 2004).
# With ten times as much nothing is visible.
_FIRST = (0.1, 0.3)
# The share of them with which a fit begins again that ended with a large torque: they hid what the motion tells. With a
# share of 0.03 to 0.3 of the torque two records with coarse encoders ended at one place, with all of it one did not.
# `tests/hypotheses/test_coarse_encoders.py` checks it.
_BEGUN_AGAIN = 0.1
# And the least: a thousandth of what the sensors of the project's data sheets can show.
_LEAST = (1e-5, 1e-4)
# Steps of scoring with damping (Levenberg 1944, Marquardt 1963): most of a fit, and gain in nats that ends it.
_MOST_STEPS, _SETTLED = 30, 1.0
# Share of what a fit is behind another that a step has to gain: smaller ones come nowhere near it. With 0.02 and with
# 0.2 the development files have the same answers (`python benchmarks/explain_study.py`).
_NEARER = 0.1
# Places of each stop that are tried over its tolerance: before it is met, no slope leads there.
_STOPS_TRIED = 6
# Standard deviation of the logarithm of a variance of noise: a data sheet is off by a factor of two in amplitude.
_NOISE = 2.0 * math.log(2.0)
_AT_ONCE = 100.0  # factor by which a variance changes in a step, at most
_FREE = 1e3  # standard deviation of a variance of which nothing is known, as a multiple of it
_LEAST_NOISE = 1e-6  # least variance of noise, as a multiple of what is stated
_WALL = 0.02  # of a tolerance: standard deviation of the wall beyond it
# Newton steps to the largest posterior of a linear model: weight of a distance beyond a bound, in the prior's standard
# deviations; steps at most (each crosses a wall or is the last); gain in nats that ends them; Armijo's share of the
# slope; and the shortest part of a step that is tried.
_HARD, _NEWTON, _FLAT, _ARMIJO, _SHORTEST = 1e4, 50, 1e-3, 0.1, 1e-6
_FARTHEST = 3.0  # standard deviations that an unknown moves at a time
# Error of a parameter by the length of the filter's steps, as a share: with `kalman._LONGEST` a fourth as long, the
# inertia that `python benchmarks/estimation_core.py` fits changes by 0.02 %, every other parameter by less.
_STEPS = 1.5e-4
_DAMPED = (1e-3, 1e-6, 1e3)  # damping at the start, least, and that of a step which is not worth its pass


@dataclass(frozen=True, slots=True)
class Fitted:
    """A model at its largest posterior.

    `posterior`: log-likelihood and log-prior, in nats. `normal`: of the unknowns, in units of their parameters, and of
    the variances behind them, in shares; without the prior. `attenuation`: see `_attenuation`.
    """

    parameters: Float64
    unknowns: tuple[Unknown, ...]
    posterior: float
    filtered: Filtered
    normal: Normal
    attenuation: float

    @property
    def disturbance(self) -> Disturbance:
        """The likeliest disturbances and noise."""
        return self.filtered.disturbance

    @property
    def covariance(self) -> Float64:
        """Posterior covariance of the unknowns (c, c), by Laplace's approximation.

        Entries are in the units of the unknowns. It includes the error by the length of the filter's steps, and
        for an inductance the attenuation by noise of the voltage's reading.
        """
        scale, values = _scale(self.unknowns), np.array([self.parameters[one.place] for one in self.unknowns])
        shares = [self.attenuation if one.place == INDUCTANCE else 0.0 for one in self.unknowns]
        off = values * np.hypot(_STEPS, shares)
        return np.asarray(np.linalg.inv(self._curved) * np.outer(scale, scale) + np.diag(off**2))

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
        scale, count = _scale(self.unknowns), len(self.unknowns)
        _, bends = prior_slope(self.parameters, self.unknowns)
        return self.normal.matrix[:count, :count] * np.outer(scale, scale) + np.diag(bends)


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
    scale = _scale(unknowns)
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


def begun(record: Record, parameters: Float64, unknowns: Sequence[Unknown], disturbance: Disturbance) -> Fitted:
    """Return where a fit begins."""
    return _scored(record, unknowns, _tried(record, parameters, unknowns, disturbance))


def climbed(record: Record, fit: Fitted, steps: int = _MOST_STEPS, aim: float = -np.inf) -> Fitted:
    """Return the largest posterior near a fit.

    Unknowns and the variances of disturbances and noise are fitted together, by Fisher's scoring: where an unknown and
    a disturbance have nearly the same effect, neither would move far alone. `aim` is a posterior that is known to be
    reached by others: a fit far below it ends at steps that come no nearer.
    """
    damping = _DAMPED[0]
    for _ in range(steps):
        least = max(_SETTLED, _NEARER * (aim - fit.posterior))
        found, damping = _better(record, fit, damping, least)
        if found is None:
            break
        gain, fit = found.posterior - fit.posterior, _scored(record, fit.unknowns, found)
        damping = max(0.1 * damping, _DAMPED[1])
        if gain < least:
            break
    return fit


def settled(record: Record, fit: Fitted, aim: float = -np.inf) -> Fitted:
    """Return a fit to its end; `aim` as in `climbed`.

    Disturbances that are too large hide what an unknown does, and no slope leads to smaller ones. So smaller ones are
    tried, as long as the posterior grows. Where noise stands for what is missing, the fit begins again with a large
    disturbance instead. Where a torque does that is larger than the first one, it begins again as stated, with small
    disturbances: that fit is the better one where it needs no such torque.
    """
    fit = climbed(record, fit, aim=aim)
    if max(fit.disturbance.noise[:-1]) > math.exp(_NOISE):
        start = begun(record, fit.parameters, fit.unknowns, first_disturbance(fit.parameters))
        fit = max(fit, climbed(record, start, aim=max(aim, fit.posterior)), key=lambda one: one.posterior)
    fit, first = _lowered(record, fit, aim), first_disturbance(fit.parameters)
    if fit.disturbance.torque > first.torque:
        small = replace(first, torque=_BEGUN_AGAIN * first.torque, voltage=_BEGUN_AGAIN * first.voltage)
        stated, aim = as_stated(fit.parameters, fit.unknowns), max(aim, fit.posterior)
        found = _lowered(record, climbed(record, begun(record, stated, fit.unknowns, small), aim=aim), aim)
        if found.disturbance.torque < first.torque and found.posterior > fit.posterior:
            return found
    return fit


def _lowered(record: Record, fit: Fitted, aim: float) -> Fitted:
    """Return a fit with smaller disturbances, as long as it is the likelier for them."""
    while (lower := _lower(fit)) != fit.disturbance:
        start = begun(record, fit.parameters, fit.unknowns, lower)
        found = climbed(record, start, aim=max(aim, fit.posterior))
        if found.posterior < fit.posterior + max(_SETTLED, _NEARER * (aim - fit.posterior)):
            break
        fit = found
    return fit


def _lower(fit: Fitted) -> Disturbance:
    """Return disturbances a step lower, where they are not at their least."""
    step = math.sqrt(_AT_ONCE)
    torque, voltage = (
        max(one / step, least)
        for one, least in zip((fit.disturbance.torque, fit.disturbance.voltage), _least(fit), strict=True)
    )
    return replace(fit.disturbance, torque=torque, voltage=voltage)


class _Tried(NamedTuple):
    """What a fit tries, not scored."""

    parameters: Float64
    filtered: Filtered
    posterior: float


def _tried(record: Record, parameters: Float64, unknowns: Sequence[Unknown], disturbance: Disturbance) -> _Tried:
    at = filtered(record, parameters, disturbance, is_kept=True)
    noise = -0.5 * sum((math.log(one) / _NOISE) ** 2 for one in disturbance.noise)
    return _Tried(parameters, at, at.log_likelihood + log_prior(parameters, unknowns) + noise)


def _scored(record: Record, unknowns: Sequence[Unknown], tried: _Tried) -> Fitted:
    normal = scored(record, tried.filtered, [one.column() for one in unknowns])
    attenuation = _attenuation(record, tried.filtered)
    return Fitted(tried.parameters, tuple(unknowns), tried.posterior, tried.filtered, normal, attenuation)


def _attenuation(record: Record, at: Filtered) -> float:
    """Return the share by which an inductance may come out too large.

    A regression on what was read with noise is attenuated by the noise's share of its variance (Fuller 1987): here on
    the voltage that drives the winding beyond its current and back-EMF.
    """
    p, states = at.parameters, at.states
    drives = record.voltage - states[:, VOLTAGE] - p[RESISTANCE] * states[:, CURRENT] - p[BACK_EMF] * states[:, OMEGA]
    noise = at.disturbance.noise.voltage * record.settings[NOISE_VOLTAGE]
    return float(min(noise / max(np.mean(drives**2), noise), 1.0))


def _better(record: Record, fit: Fitted, damping: float, least: float) -> tuple[_Tried | None, float]:
    """Return what is likelier than a fit, and the damping of that step.

    None where no step is expected to gain half of `least` nats, or none of them gains any.
    """
    count, variances = len(fit.unknowns), _unknown_variances(record, fit)
    values = np.array([*(fit.parameters[one.place] for one in fit.unknowns), *np.ones(VARIANCES)])
    while damping <= _DAMPED[2]:
        step, gain = best_step(values, [*fit.unknowns, *variances], fit.normal.matrix, fit.normal.gradient, damping)
        if 2.0 * gain < least:
            break
        moved = _moved(fit.parameters, fit.unknowns, step[:count])
        found = _tried(record, moved, fit.unknowns, _varied(fit.disturbance, variances, step[count:]))
        if found.posterior > fit.posterior:
            return found, damping
        damping = max(10.0 * damping, 10.0 * _DAMPED[0])
    return None, damping


def _unknown_variances(record: Record, fit: Fitted) -> list[Unknown]:
    """Return variances as unknowns, in shares of what they are.

    A disturbance falls or rises by a decade at a time, at most. The prior of a variance of noise is in its logarithm,
    and a sensor may have more noise than its data sheet states: what an unmodelled effect adds to its readings. Else a
    disturbance would be needed for that. A stamp is off by what is uniform within a sample, at most.
    """
    leasts = [one**2 for one in _least(fit)] + [_LEAST_NOISE] * len(fit.disturbance.noise)
    mosts = [np.inf] * (VARIANCES - 1) + [_most_jitter(record)]
    found = []
    for place, (one, least, most) in enumerate(zip(_variances(fit.disturbance), leasts, mosts, strict=True)):
        low, high = min(max(least / one, 1.0 / _AT_ONCE), 1.0), max(min(most / one, _AT_ONCE), 1.0)
        mean, deviation = (1.0, _FREE) if place in (Q_TORQUE, Q_VOLTAGE) else (1.0 - math.log(one), _NOISE)
        found.append(Unknown("variance", place, mean, deviation, low=low, high=high))
    return found


def _varied(disturbance: Disturbance, unknowns: Sequence[Unknown], step: Float64) -> Disturbance:
    """Return disturbances with variances that a step changes."""
    shares = [np.clip(1.0 + by * one.deviation, one.low, one.high) for one, by in zip(unknowns, step, strict=True)]
    found = [float(one * share) for one, share in zip(_variances(disturbance), shares, strict=True)]
    return Disturbance(math.sqrt(found[0]), math.sqrt(found[1]), Noise(*found[2:]))


def _least(fit: Fitted) -> tuple[float, float]:
    """Return the least disturbances, in N·m and in V."""
    return _LEAST[0] * float(fit.parameters[COULOMB]), _LEAST[1]


def calibrated(record: Record, parameters: Float64, unknowns: Sequence[Unknown]) -> Fitted:
    """Return the fit of base parameters, from as far off as their tolerances allow."""
    first = first_disturbance(parameters)
    p = _at_stops(record, parameters, unknowns, first)
    placed = record.placed(p)
    return settled(placed, begun(placed, p, unknowns, first))


def first_disturbance(parameters: Float64) -> Disturbance:
    """Return disturbances and noise at the start of a fit."""
    return Disturbance(_FIRST[0] * float(parameters[COULOMB]), _FIRST[1])


def _variances(disturbance: Disturbance) -> tuple[float, ...]:
    return (disturbance.torque**2, disturbance.voltage**2, *disturbance.noise)


def _most_jitter(record: Record) -> float:
    """Return the largest variance of a clock's jitter, in multiples of the assumed."""
    return float(np.median(record.dt) ** 2 / 12.0 / record.settings[JITTER] ** 2)


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


def _scale(unknowns: Sequence[Unknown]) -> Float64:
    return np.array([one.deviation for one in unknowns])


def _moved(parameters: Float64, unknowns: Sequence[Unknown], step: Float64) -> Float64:
    p = parameters.copy()
    for one, moves in zip(unknowns, step, strict=True):
        one.put(p, float(np.clip(p[one.place] + moves * one.deviation, one.low, one.high)))
    p[STICTION] = max(p[STICTION], p[COULOMB])
    return p
