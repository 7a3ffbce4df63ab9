"""What held the plate when a record began is not in it: where that alone speaks against a model, it is not judged."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.fitting.floor import group_means, weigh
from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.findings import Standing
from etb_hil.discrepancy.search.standing import standing_near
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector

_MOST = 0.5  # of what is over the bands


def since_it_slid(model: Model, balances: Sequence[Balances], standing: Standing, rounds: int) -> Standing:
    """Return where a model stands without the torque before the first slide where most that speaks against it is there.

    Then that torque is not judged in the balances (in place) any more; elsewhere they and the standing stay.
    """
    against = _against(standing, balances, standing.calibration.fit.whole)
    if against == 0.0:
        return standing
    regimes = [b.regimes for b in balances]
    for b in balances:
        b.regimes = b.regimes.since_it_slid()
    if all((b.regimes.is_stuck == before.is_stuck).all() for b, before in zip(balances, regimes, strict=True)):
        return standing
    weigh(balances, standing.floor.level)
    fitted = calibrate(model, balances, standing.calibration.fit.whole, standing.calibration.unknowns)
    if _against(standing, balances, fitted.fit.whole) < (1.0 - _MOST) * against:
        return standing_near(model, balances, fitted.fit.whole, fitted.unknowns, rounds)
    for b, before in zip(balances, regimes, strict=True):
        b.regimes = before
    weigh(balances, standing.floor.level)
    return standing


def _against(standing: Standing, balances: Sequence[Balances], whole: Vector) -> float:
    """Return what is over the bands by more than chance, in samples of the noise floor."""
    means, rows = group_means(balances, whole)
    groups = means / standing.floor.level
    return float(decision.excess(groups, np.where(decision.beyond_chance(groups, rows), rows, 0)).sum())
