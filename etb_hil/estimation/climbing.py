"""Climb to the largest posterior of unknowns and variances, by scoring.

The variances are those of disturbances and noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from etb_hil.estimation.filtering import Disturbance, Filtered, Noise, Normal, filtered
from etb_hil.estimation.kalman import JITTER
from etb_hil.estimation.prior import best_step, log_prior, prior_slope, scales
from etb_hil.estimation.record import Record
from etb_hil.estimation.scoring import scored
from etb_hil.estimation.throttle import CURRENT, OMEGA, VOLTAGE
from etb_hil.estimation.unknown import Unknown
from etb_hil.estimation.variances import Q_TORQUE, Q_VOLTAGE, VARIANCES
from etb_hil.plant.physics import BACK_EMF, COULOMB, INDUCTANCE, RESISTANCE, STICTION, TORQUE_PER_AMPERE
from etb_hil.recording.samples import Float64

# The least disturbances, torque as a share of T_c and voltage as a share of that which overcomes T_c at rest: a
# thousandth of what the sensors of the project's data sheets can show.
_LEAST = (1e-5, 1.7e-4)
# Steps of scoring with damping (Levenberg 1944, Marquardt 1963): most of a fit, and gain in nats that ends it.
_MOST_STEPS, SETTLED = 30, 1.0
# Share of what a fit is behind another that a step has to gain: smaller ones come nowhere near it. With 0.02 and with
# 0.2 the development files have the same answers (`python benchmarks/explain_study.py`).
NEARER = 0.1
# Standard deviation of the logarithm of a variance of noise: a data sheet is off by a factor of two in amplitude.
NOISE_DEVIATION = 2.0 * math.log(2.0)
AT_ONCE = 100.0  # factor by which a variance changes in a step, at most
_FREE = 1e3  # standard deviation of a variance of which nothing is known, as a multiple of it
_LEAST_NOISE = 1e-6  # least variance of noise, as a multiple of what is stated
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
        scale, values = scales(self.unknowns), np.array([self.parameters[one.place] for one in self.unknowns])
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
        scale, count = scales(self.unknowns), len(self.unknowns)
        _, bends = prior_slope(self.parameters, self.unknowns)
        return self.normal.matrix[:count, :count] * np.outer(scale, scale) + np.diag(bends)


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
        least = max(SETTLED, NEARER * (aim - fit.posterior))
        found, damping = _better(record, fit, damping, least)
        if found is None:
            break
        gain, fit = found.posterior - fit.posterior, _scored(record, fit.unknowns, found)
        damping = max(0.1 * damping, _DAMPED[1])
        if gain < least:
            break
    return fit


def least_disturbances(fit: Fitted) -> tuple[float, float]:
    """Return the least disturbances, in N·m and in V."""
    return _LEAST[0] * float(fit.parameters[COULOMB]), _LEAST[1] * breaking_away(fit.parameters)


def breaking_away(parameters: Float64) -> float:
    """Return the voltage in V that overcomes T_c at rest.

    It is a force in N or N·m where that stands for the voltage.
    """
    return float(parameters[COULOMB] * parameters[RESISTANCE] / parameters[TORQUE_PER_AMPERE])


class _Tried(NamedTuple):
    """What a fit tries, not scored."""

    parameters: Float64
    filtered: Filtered
    posterior: float


def _tried(record: Record, parameters: Float64, unknowns: Sequence[Unknown], disturbance: Disturbance) -> _Tried:
    at = filtered(record, parameters, disturbance, is_kept=True)
    noise = -0.5 * sum((math.log(one) / NOISE_DEVIATION) ** 2 for one in disturbance.noise)
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
    noise = at.voltage_variance
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
    leasts = [one**2 for one in least_disturbances(fit)] + [_LEAST_NOISE] * len(fit.disturbance.noise)
    mosts = [np.inf] * (VARIANCES - 1) + [_most_jitter(record)]
    found = []
    for place, (one, least, most) in enumerate(zip(_variances(fit.disturbance), leasts, mosts, strict=True)):
        low, high = min(max(least / one, 1.0 / AT_ONCE), 1.0), max(min(most / one, AT_ONCE), 1.0)
        mean, deviation = (1.0, _FREE) if place in (Q_TORQUE, Q_VOLTAGE) else (1.0 - math.log(one), NOISE_DEVIATION)
        found.append(Unknown("variance", place, mean, deviation, low=low, high=high))
    return found


def _varied(disturbance: Disturbance, unknowns: Sequence[Unknown], step: Float64) -> Disturbance:
    """Return disturbances with variances that a step changes."""
    shares = [np.clip(1.0 + by * one.deviation, one.low, one.high) for one, by in zip(unknowns, step, strict=True)]
    found = [float(one * share) for one, share in zip(_variances(disturbance), shares, strict=True)]
    return Disturbance(math.sqrt(found[0]), math.sqrt(found[1]), Noise(*found[2:]))


def _variances(disturbance: Disturbance) -> tuple[float, ...]:
    return (disturbance.torque**2, disturbance.voltage**2, *disturbance.noise)


def _most_jitter(record: Record) -> float:
    """Return the largest variance of a clock's jitter, in multiples of the assumed."""
    return float(np.median(record.dt) ** 2 / 12.0 / record.settings[JITTER] ** 2)


def _moved(parameters: Float64, unknowns: Sequence[Unknown], step: Float64) -> Float64:
    p = parameters.copy()
    for one, moves in zip(unknowns, step, strict=True):
        one.put(p, float(np.clip(p[one.place] + moves * one.deviation, one.low, one.high)))
    p[STICTION] = max(p[STICTION], p[COULOMB])
    return p
