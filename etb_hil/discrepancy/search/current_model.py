"""The current model of a search: its noise floor, weights and calibration."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.fitting.noise_floor import group_means, noise_floor_of, weigh
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.discrepancy.search.findings import CurrentModel, Findings
from etb_hil.discrepancy.search.thresholds import beyond_chance, excess
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector

_MOST = 0.5  # of what is over the thresholds, that may be before the first slide


def continue_from(findings: Findings, whole: Vector, unknowns: Sequence[Unknown]) -> None:
    """Continue the search near `whole`: noise floor, weights, calibration."""
    findings.current_model = current_model_near(findings.model, findings.balances, whole, unknowns)


def current_model_near(
    model: Model, balances: Sequence[Balances], whole: Vector, unknowns: Sequence[Unknown], iterations: int = 4
) -> CurrentModel:
    """Return the model near `whole`."""
    noise_floor = noise_floor_of(model, balances, whole, unknowns)
    weigh(balances, noise_floor.level)
    calibration = calibrate(model, balances, whole, unknowns, iterations)
    means, _ = group_means(balances, calibration.fit.whole)
    return CurrentModel(calibration, noise_floor, means / noise_floor.level)


def after_first_slide(
    model: Model, balances: Sequence[Balances], current_model: CurrentModel, iterations: int
) -> CurrentModel:
    """Return the model without torque before the first slide, if most excess is there.

    The friction state at the beginning of a record is unknown: where torque there alone contradicts a model, it is not
    judged in the balances (in place) any more. Otherwise they and the model stay.
    """
    against = _against(current_model, balances, current_model.calibration.fit.whole)
    if against == 0.0:
        return current_model
    regimes = [b.regimes for b in balances]
    for b in balances:
        b.regimes = b.regimes.after_first_slide()
    if all((b.regimes.is_stuck == before.is_stuck).all() for b, before in zip(balances, regimes, strict=True)):
        return current_model
    weigh(balances, current_model.noise_floor.level)
    fitted = calibrate(model, balances, current_model.calibration.fit.whole, current_model.calibration.unknowns)
    if _against(current_model, balances, fitted.fit.whole) < (1.0 - _MOST) * against:
        return current_model_near(model, balances, fitted.fit.whole, fitted.unknowns, iterations)
    for b, before in zip(balances, regimes, strict=True):
        b.regimes = before
    weigh(balances, current_model.noise_floor.level)
    return current_model


def _against(current_model: CurrentModel, balances: Sequence[Balances], whole: Vector) -> float:
    """Return the significant excess over the thresholds, in noise-floor samples."""
    means, samples = group_means(balances, whole)
    groups = means / current_model.noise_floor.level
    return float(excess(groups, np.where(beyond_chance(groups, samples), samples, 0)).sum())
