"""The current model of a search, and its replacement by another one."""

from __future__ import annotations

from collections.abc import Sequence

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.fitting.noise_floor import group_means, noise_floor_of, weigh
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.discrepancy.search.findings import CurrentModel, Findings
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector


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
