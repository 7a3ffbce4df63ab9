"""Calibration of the base model inside its stated tolerances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.fit import TOLERANCE, Fit, Residual, fit_of, gauss_newton
from etb_hil.discrepancy.fitting.unknowns import (
    SLACK,
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
from etb_hil.plant.physics import LIMP_HOME, STOP_HIGH, STOP_LOW, Vector

Float64 = NDArray[np.float64]

_ITERATIONS = 10
_INSIDE = 1e-3  # rad from the end of the travel
_RESTS = 0.02  # rad/s


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
    first: Float64 | None = None,
    tolerance: float = TOLERANCE,
) -> Calibration:
    """Fit base parameters within their tolerances, and the nuisances.

    The fit starts at `begin` where given. `unknowns`: what is fitted instead, such as an effect's parameters, too.
    `first`: a Jacobian from nearby.
    """
    residual = residual_of(balances)
    fitted = all_unknowns(model, balances) if unknowns is None else list(unknowns)
    whole = _at_the_stops(start(model), fitted, balances) if begin is None else begin
    fit, jacobian = gauss_newton(
        residual, fit_of(residual, whole), fitted, iterations, tolerance=tolerance, first=first
    )
    return Calibration(fitted, fit, jacobian)


def all_unknowns(model: Model, balances: Sequence[Balances]) -> list[Unknown]:
    """Return nuisances, base parameters, and parameters of the model's own effects."""
    # Nuisances first: their columns need no integration, as long as the point that they are taken at is remembered.
    has_current = all(b.has[1] for b in balances)
    found = nuisance_unknowns(max(b.measured.dt for b in balances), has_current=has_current) + base_unknowns(model)
    vector = model.vector()
    for entry in model.effects:
        effect = CATALOGUE[entry.id]
        own = effect_unknowns(effect, [float(vector[place]) for place in effect.indices], balances[0].load)
        found += measured_unknowns(own, effect, model)
    return found


def beginnings(whole: Vector, unknowns: Sequence[Unknown], balances: Sequence[Balances]) -> list[Vector]:
    """Return start vectors: as stated, with limp-home as seen, with stops met early."""
    stated = whole.copy()
    for unknown in unknowns:
        if "." not in unknown.name and unknown.high <= SLACK:  # no cause's own
            unknown.put(stated, 0.0)
    stated = _at_the_stops(stated, unknowns, balances)
    return [stated, _at_limp_home(stated.copy(), unknowns, balances), _met_early(stated.copy(), unknowns)]


def _touches(balances: Sequence[Balances]) -> tuple[float, float]:
    """Return the positions (rad) of stops that the ends of the motion just touch."""
    lowest = min(float(b.measured.angle.min()) for b in balances) + _INSIDE
    return lowest, max(float(b.measured.angle.max()) for b in balances) - _INSIDE


def _at_the_stops(whole: Vector, unknowns: Sequence[Unknown], balances: Sequence[Balances]) -> Vector:
    """Move a stop that the motion just missed to where it touches (in place).

    No gradient leads there.
    """
    lowest, highest = _touches(balances)
    for unknown in unknowns:
        if unknown.place == STOP_HIGH and highest < whole[STOP_HIGH]:
            unknown.put(whole, float(np.clip((highest - unknown.centre) / unknown.scale, unknown.low, 0.0)))
        if unknown.place == STOP_LOW and lowest > whole[STOP_LOW]:
            unknown.put(whole, float(np.clip((lowest - unknown.centre) / unknown.scale, 0.0, unknown.high)))
    return whole


def _met_early(whole: Vector, unknowns: Sequence[Unknown]) -> Vector:
    """Move the stops to the inner edges of their tolerances (in place).

    A gradient leads out from there, but none in.
    """
    for unknown in unknowns:
        if unknown.place == STOP_HIGH and unknown.high <= SLACK:
            unknown.put(whole, unknown.low)
        if unknown.place == STOP_LOW and unknown.high <= SLACK:
            unknown.put(whole, unknown.high)
    return whole


def _at_limp_home(whole: Vector, unknowns: Sequence[Unknown], balances: Sequence[Balances]) -> Vector:
    """Move limp-home to where the plate rested with an open bridge (in place).

    The springs' jump has local minima about it.
    """
    rested = []
    for b in balances:
        angle, velocity = b.motion(whole[:EXTENDED])
        rested.append(angle[b.is_open & (np.abs(velocity) < _RESTS)])
    angles = np.concatenate(rested)
    for unknown in unknowns:
        if unknown.place == LIMP_HOME and unknown.high <= SLACK and len(angles):
            x = (float(np.median(angles)) - unknown.centre) / unknown.scale
            unknown.put(whole, float(np.clip(x, unknown.low, unknown.high)))
    return whole
