"""The base model moved inside its stated tolerances before anything is suspected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.fit import Fit, Residual, fit_of, gauss_newton
from etb_hil.discrepancy.unknowns import (
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

Float64 = NDArray[np.float64]

_ROUNDS = 10
_INSIDE = 1e-3  # rad from the end of the travel


@dataclass(frozen=True, slots=True)
class Calibration:
    """The base model as calibrated, with the columns (n, unknowns) of its last linearisation."""

    unknowns: list[Unknown]
    fit: Fit
    columns: Float64


def residual_of(balances: Sequence[Balances]) -> Residual:
    """Return the residual of several stretches as one function of the whole vector."""

    def residual(whole: Vector) -> Float64:
        return np.concatenate([b.residual(whole[:EXTENDED], whole[EXTENDED:]) for b in balances])

    return residual


def calibrate(
    model: Model,
    balances: Sequence[Balances],
    begin: Vector | None = None,
    unknowns: Sequence[Unknown] | None = None,
    rounds: int = _ROUNDS,
    first: Float64 | None = None,
) -> Calibration:
    """Fit the base parameters in the box of their tolerances, and the nuisances; starting at `begin` where given.

    `unknowns`: what is fitted instead, for instance an effect's parameters, too. `first`: columns from somewhere near.
    """
    residual = residual_of(balances)
    fitted = all_unknowns(model, balances) if unknowns is None else list(unknowns)
    whole = at_the_stops(start(model), fitted, balances) if begin is None else begin
    fit, columns = gauss_newton(residual, fit_of(residual, whole), fitted, rounds, first=first)
    return Calibration(fitted, fit, columns)


def all_unknowns(model: Model, balances: Sequence[Balances]) -> list[Unknown]:
    """Return nuisances, base parameters, and the parameters of effects that the model has already."""
    # Nuisances first: their columns need no integration, as long as the point that they are taken at is remembered.
    found = nuisance_unknowns(max(b.measured.dt for b in balances)) + base_unknowns(model)
    vector = model.vector()
    for entry in model.effects:
        effect = CATALOGUE[entry.id]
        own = effect_unknowns(effect, [float(vector[place]) for place in effect.indices], balances[0].load)
        found += measured_unknowns(own, effect, model)
    return found


def at_the_stops(whole: Vector, unknowns: Sequence[Unknown], balances: Sequence[Balances]) -> Vector:
    """Put a stop that the motion may just have missed to where it touches (in place): no slope leads there."""
    highest = max(float(b.measured.angle.max()) for b in balances) - _INSIDE
    lowest = min(float(b.measured.angle.min()) for b in balances) + _INSIDE
    for unknown in unknowns:
        if unknown.place == STOP_HIGH and highest < whole[STOP_HIGH]:
            unknown.put(whole, float(np.clip((highest - unknown.centre) / unknown.scale, unknown.low, 0.0)))
        if unknown.place == STOP_LOW and lowest > whole[STOP_LOW]:
            unknown.put(whole, float(np.clip((lowest - unknown.centre) / unknown.scale, 0.0, unknown.high)))
    return whole
