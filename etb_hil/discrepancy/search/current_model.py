"""The current model of a search, and its replacement by another one."""

from __future__ import annotations

from collections.abc import Sequence

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import beginnings, calibrate
from etb_hil.discrepancy.fitting.noise_floor import group_means, noise_floor_of, weigh
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.discrepancy.search.findings import CurrentModel, Findings
from etb_hil.discrepancy.search.thresholds import excess
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector

_CLEARLY = 0.9  # of what a fit left: from another start it has to leave less than that


def continue_from(findings: Findings, whole: Vector, unknowns: Sequence[Unknown]) -> None:
    """Continue the search near `whole`: noise floor, weights, calibration."""
    findings.current_model = current_model_near(findings.model, findings.balances, whole, unknowns)


def current_model_near(
    model: Model, balances: Sequence[Balances], whole: Vector, unknowns: Sequence[Unknown], iterations: int = 4
) -> CurrentModel:
    """Return the model near `whole`, or a better one started from nominal values."""
    current_model, missing = _current_model(model, balances, whole, unknowns, iterations)
    if missing > 0.0:
        # Base parameters stood in for what was missing, or may be held there by a hill: they begin again as stated.
        starts = beginnings(current_model.calibration.fit.whole, unknowns, balances)
        begun = [calibrate(model, balances, start, unknowns) for start in starts]
        again = min(begun, key=lambda found: found.fit.cost)
        if again.fit.cost < _CLEARLY * current_model.calibration.fit.cost:
            current_model, _ = _current_model(model, balances, again.fit.whole, unknowns, iterations)
    return current_model


def _current_model(
    model: Model, balances: Sequence[Balances], whole: Vector, unknowns: Sequence[Unknown], iterations: int
) -> tuple[CurrentModel, float]:
    """Return the model near `whole`, and its excess over the thresholds."""
    noise_floor = noise_floor_of(model, balances, whole, unknowns)
    weigh(balances, noise_floor.level)
    calibration = calibrate(model, balances, whole, unknowns, iterations)
    means, samples = group_means(balances, calibration.fit.whole)
    groups = means / noise_floor.level
    return CurrentModel(calibration, noise_floor, groups), float(excess(groups, samples).sum())
