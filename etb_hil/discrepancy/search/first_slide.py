"""The friction state at the beginning of a record, which is unknown.

Torque before the first slide is not judged where it alone contradicts a model.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.fitting.noise_floor import group_means, weigh
from etb_hil.discrepancy.search.current_model import current_model_near
from etb_hil.discrepancy.search.findings import CurrentModel
from etb_hil.discrepancy.search.thresholds import beyond_chance, excess
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector

_MOST = 0.5  # of what is over the thresholds


def after_first_slide(
    model: Model, balances: Sequence[Balances], current_model: CurrentModel, iterations: int
) -> CurrentModel:
    """Return the model without torque before the first slide, if most excess is there.

    Then that torque is not judged in the balances (in place) any more; otherwise they and the model stay.
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
