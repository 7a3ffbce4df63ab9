"""Calibrate base parameters inside their tolerances by the likelihood of a record.

Every constant of the model is free with a prior; none is believed exact: with a few of them off by 3 % and held fixed,
healthy records show false causes. Beside the Gaussian prior a steep wall stands at the tolerance, or an inertia that
is 30 % off would be swallowed. The disturbances start large and fall by a decade a round, refitted in between: with
small ones from the start a wrong model locks the filter out, with large ones nothing is visible.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from etb_hil.estimation.filtering import Column, Disturbance, Filtered, Normal, filtered, sensitivities
from etb_hil.estimation.record import Record
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import BACK_EMF, COULOMB, STICTION, TORQUE_PER_AMPERE
from etb_hil.plant.values import ThrottleParameters
from etb_hil.recording.samples import Float64

FIRST = (0.1, 0.3)  # disturbances at the start: torque as a share of T_c, voltage in V
LEAST = (1e-4, 3e-4)  # and at the end: what a healthy record of the project's plant comes down to
_WALL = 0.02  # of a tolerance: standard deviation of the wall beyond it
_STEP = 0.01  # of a standard deviation: step of the differences
_FARTHEST = 3.0  # standard deviations that an unknown moves at a time
_SETTLED = 1.0  # nats that a Gauss-Newton step has to gain
_DECADE = 10.0
_EXACT = ("gear_ratio", "supply_voltage", "voltage_limit", "back_emf")  # teeth are counted; K_e moves with K_t


@dataclass(frozen=True, slots=True)
class Unknown:
    """A parameter that is fitted: its place in the vector, its prior's mean and standard deviation.

    `reach`: how far it may be off before the wall begins, infinite for none. `tied`: what moves along in proportion.
    """

    name: str
    place: int
    mean: float
    deviation: float
    reach: float = np.inf
    effect: Effect | None = None
    tied: int = -1

    def column(self) -> Column:
        """Return what the sensitivities are asked of, in units of the parameter."""
        return Column(self.name, _STEP * self.deviation, self.place, self.effect, tied=self.tied)

    def put(self, parameters: Float64, value: float) -> None:
        """Set the parameter in a vector, in place, and what is tied to it."""
        if self.tied >= 0:
            parameters[self.tied] *= value / parameters[self.place]
        parameters[self.place] = value


@dataclass(frozen=True, slots=True)
class Fit:
    """Parameters at the posterior's largest value, with the unknowns' normal matrix there (without the prior).

    `posterior`: log-likelihood and log-prior, in nats. `normal` is in units of the unknowns' parameters.
    """

    parameters: Float64
    unknowns: tuple[Unknown, ...]
    disturbance: Disturbance
    posterior: float
    filtered: Filtered
    normal: Normal

    @property
    def covariance(self) -> Float64:
        """Posterior covariance of the unknowns (c, c), in their units; Laplace's approximation."""
        scale = np.array([one.deviation for one in self.unknowns])
        curved = self.normal.matrix * np.outer(scale, scale) + np.diag(_bends(self.parameters, self.unknowns))
        return np.asarray(np.linalg.inv(curved) * np.outer(scale, scale))

    def value(self, name: str) -> tuple[float, float]:
        """Return an unknown's value and its standard deviation, by its name; KeyError where there is none."""
        for k, one in enumerate(self.unknowns):
            if one.name == name:
                return float(self.parameters[one.place]), float(np.sqrt(self.covariance[k, k]))
        raise KeyError(name)


def base_unknowns(model: Model) -> list[Unknown]:
    """Return the base parameters that have a tolerance, each uniform within it by its first two moments."""
    found = []
    for place, one in enumerate(fields(ThrottleParameters)):
        half = model.tolerance(one.name) if one.name not in _EXACT else 0.0
        if half > 0.0:
            mean = getattr(model.values, one.name)
            tied = BACK_EMF if place == TORQUE_PER_AMPERE else -1
            found.append(Unknown(one.name, place, mean, half / np.sqrt(3.0), half, tied=tied))
    return found


def log_prior(parameters: Float64, unknowns: Sequence[Unknown]) -> float:
    """Return the logarithm of the unknowns' prior, 0 at its mean."""
    away = np.array([parameters[one.place] - one.mean for one in unknowns])
    deviation = np.array([one.deviation for one in unknowns])
    reach = np.array([one.reach for one in unknowns])
    over = np.where(np.isfinite(reach), np.maximum(np.abs(away) - reach, 0.0) / (_WALL * reach), 0.0)
    return -0.5 * float(np.sum((away / deviation) ** 2) + np.sum(over**2))


def refine(
    record: Record, parameters: Float64, unknowns: Sequence[Unknown], disturbance: Disturbance, steps: int = 4
) -> Fit:
    """Return the parameters of the largest posterior near some parameters, by Gauss-Newton on whitened innovations."""
    columns = [one.column() for one in unknowns]
    p = parameters.copy()
    at = filtered(record, p, disturbance, is_kept=True)
    posterior = at.log_likelihood + log_prior(p, unknowns)
    normal = sensitivities(record, at, columns)
    for _ in range(steps):
        found = _searched(record, p, unknowns, disturbance, posterior, _newton(p, unknowns, normal))
        if found is None:
            break
        gained, p = found[0] - posterior, found[1]
        at, posterior = filtered(record, p, disturbance, is_kept=True), found[0]
        normal = sensitivities(record, at, columns)
        if gained < _SETTLED:
            break
    return Fit(p, tuple(unknowns), disturbance, posterior, at, normal)


def calibrated(
    record: Record,
    parameters: Float64,
    unknowns: Sequence[Unknown],
    first: Disturbance | None = None,
) -> Fit:
    """Return the fit of parameters and disturbances: these fall from `first` while the likelihood grows.

    Each decade is refitted, because what a model can follow at a smaller disturbance depends on its parameters.
    """
    at = first or Disturbance(FIRST[0] * parameters[COULOMB], FIRST[1])
    fit = refine(record, parameters, unknowns, at, steps=3)
    while True:
        lower = _lower(record, fit)
        if lower is None:
            return fit
        fit = lower


def _lower(record: Record, fit: Fit) -> Fit | None:
    """Return the best fit at disturbances that are a decade lower, None where no fit is better."""
    torque, voltage = fit.disturbance.torque, fit.disturbance.voltage
    least_torque = LEAST[0] * fit.parameters[COULOMB]
    found = []
    for by in ((_DECADE, _DECADE), (_DECADE, 1.0), (1.0, _DECADE)):
        to = Disturbance(max(torque / by[0], least_torque), max(voltage / by[1], LEAST[1]))
        if to != fit.disturbance:
            at = filtered(record, fit.parameters, to)
            found.append((at.log_likelihood, to))
    for _, to in sorted(found, key=lambda one: -one[0])[:2]:
        better = refine(record, fit.parameters, fit.unknowns, to, steps=3)
        if better.posterior > fit.posterior + _SETTLED:
            return better
    return None


def _bends(parameters: Float64, unknowns: Sequence[Unknown]) -> Float64:
    """Return the prior's curvature (c) in units of its standard deviations."""
    found = np.ones(len(unknowns))
    for k, one in enumerate(unknowns):
        if abs(parameters[one.place] - one.mean) > one.reach:
            found[k] += (one.deviation / (_WALL * one.reach)) ** 2
    return found


def _newton(parameters: Float64, unknowns: Sequence[Unknown], normal: Normal) -> Float64:
    """Return the step (c) of Gauss and Newton in units of the prior's standard deviations."""
    scale = np.array([one.deviation for one in unknowns])
    away = np.array([parameters[one.place] - one.mean for one in unknowns])
    reach = np.array([one.reach for one in unknowns])
    over = np.where(np.isfinite(reach), np.sign(away) * np.maximum(np.abs(away) - reach, 0.0), 0.0)
    wall = np.where(np.isfinite(reach), scale * over / (_WALL * reach) ** 2, 0.0)
    curved = normal.matrix * np.outer(scale, scale) + np.diag(_bends(parameters, unknowns))
    slope = -normal.gradient * scale - away / scale - wall
    return np.asarray(np.clip(np.linalg.solve(curved, slope), -_FARTHEST, _FARTHEST))


def _searched(
    record: Record,
    parameters: Float64,
    unknowns: Sequence[Unknown],
    disturbance: Disturbance,
    posterior: float,
    step: Float64,
) -> tuple[float, Float64] | None:
    """Return a larger posterior along a step and its parameters, None where it grows nowhere."""
    share = 1.0
    for _ in range(4):
        p = parameters.copy()
        for one, moves in zip(unknowns, step, strict=True):
            value = p[one.place] + share * moves * one.deviation
            if one.mean > 0.0 and one.effect is None:
                value = max(value, 0.05 * one.mean)
            one.put(p, value)
        p[STICTION] = max(p[STICTION], p[COULOMB])
        found = filtered(record, p, disturbance).log_likelihood + log_prior(p, unknowns)
        if found > posterior:
            return found, p
        share *= 0.3
    return None
