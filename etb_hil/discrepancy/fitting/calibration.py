"""Calibration of the base model inside its stated tolerances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.fit import TOLERANCE, Fit, Residual, fit_of, gauss_newton
from etb_hil.discrepancy.fitting.unknowns import (
    Unknown,
    base_unknowns,
    effect_unknowns,
    measured_unknowns,
    nuisance_unknowns,
    start,
)
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import STOP_HIGH, STOP_LOW, Vector
from etb_hil.recording.samples import Float64

_ITERATIONS = 10
_INSIDE = 1e-3  # rad from the end of the travel


@dataclass(frozen=True, slots=True)
class Calibration:
    """The base model as calibrated, with the Jacobian (n, unknowns) at its end."""

    unknowns: list[Unknown]
    fit: Fit
    jacobian: Float64


def residual_of(balances: Sequence[Balances]) -> Residual:
    """Return the residual of several segments as a function of the whole vector."""

    def residual(whole: Vector) -> Float64:
        return np.concatenate([b.residual(whole[:EXTENDED], whole[EXTENDED:]) for b in balances])

    return residual


def calibrate(
    model: Model,
    balances: Sequence[Balances],
    begin: Vector | None = None,
    unknowns: Sequence[Unknown] | None = None,
    iterations: int = _ITERATIONS,
    tolerance: float = TOLERANCE,
) -> Calibration:
    """Fit base parameters within their tolerances, and the nuisances.

    The fit starts at `begin` where given. `unknowns`: what is fitted instead, such as an effect's parameters, too.
    """
    residual = residual_of(balances)
    fitted = all_unknowns(model, balances) if unknowns is None else list(unknowns)
    whole = _at_the_stops(start(model), fitted, balances) if begin is None else begin
    fit, jacobian = gauss_newton(residual, fit_of(residual, whole), fitted, iterations, tolerance=tolerance)
    return Calibration(fitted, fit, jacobian)


def all_unknowns(model: Model, balances: Sequence[Balances]) -> list[Unknown]:
    """Return nuisances, base parameters, and parameters of the model's own effects."""
    # Nuisances first: their columns need no integration, as long as the point that they are taken at is remembered.
    has_current = all(b.has[1] for b in balances)
    found = nuisance_unknowns(max(b.measured.dt for b in balances), has_current=has_current) + base_unknowns(model)
    vector = model.vector()
    for entry in model.effects:
        effect = CATALOGUE[entry.id]
        own = effect_unknowns(
            effect, [float(vector[place]) for place in effect.indices], balances[0].load, balances[0].largest
        )
        found += measured_unknowns(own, effect, model)
    return found


def _at_the_stops(whole: Vector, unknowns: Sequence[Unknown], balances: Sequence[Balances]) -> Vector:
    """Move a stop that the motion just missed to where it touches (in place).

    No gradient leads there.
    """
    lowest = min(float(b.measured.angle.min()) for b in balances) + _INSIDE
    highest = max(float(b.measured.angle.max()) for b in balances) - _INSIDE
    for unknown in unknowns:
        if unknown.place == STOP_HIGH and highest < whole[STOP_HIGH]:
            unknown.put(whole, float(np.clip((highest - unknown.centre) / unknown.scale, unknown.low, 0.0)))
        if unknown.place == STOP_LOW and lowest > whole[STOP_LOW]:
            unknown.put(whole, float(np.clip((lowest - unknown.centre) / unknown.scale, 0.0, unknown.high)))
    return whole
