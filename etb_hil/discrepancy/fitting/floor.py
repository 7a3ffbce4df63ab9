"""The noise floor of this very case: the calibrated model's own simulation, through the same balances and calibration.

A fixed noise floor does not work: nearly at rest and on the stops it varies twentyfold between devices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration, calibrate
from etb_hil.discrepancy.fitting.luck import luck
from etb_hil.discrepancy.fitting.rerun import rerun
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector

Float64 = NDArray[np.float64]

GROUPS = 9  # 3 balances by 3 regimes
_LOWEST = 0.05  # below it a noise floor is sampling variance: noise alone leaves more
LEAST_ROWS = 25  # of a group that is judged: 0.1 s


@dataclass(frozen=True, slots=True)
class Floor:
    """Mean square (9) by group of what a true model may leave before any weight, and the rerun it was found in.

    `truth`: the whole vector that was simulated; how far the rerun's calibration is from it says how well one finds it.
    """

    level: Float64
    balances: list[Balances]
    calibration: Calibration
    truth: Vector


def group_means(balances: Sequence[Balances], whole: Vector) -> tuple[Float64, NDArray[np.int64]]:
    """Return mean squares (9) of the unweighted residual by group, and the samples (9) of each."""
    total, count = np.zeros(GROUPS), np.zeros(GROUPS, np.int64)
    for b in balances:
        left = np.concatenate(b.channels(whole[:EXTENDED], whole[EXTENDED:]))
        groups = b.judged_groups()
        inside = groups >= 0
        total += np.bincount(groups[inside], left[inside] ** 2, GROUPS)
        count += np.bincount(groups[inside], minlength=GROUPS)
    return total / np.maximum(count, 1), count


def floor_of(
    model: Model, balances: Sequence[Balances], whole: Vector, unknowns: Sequence[Unknown], seed: int = 1
) -> Floor:
    """Return the floor of the model at `whole`: simulated along the motion, measured, its unknowns fitted again."""
    again = [Balances(rerun(b, whole[:EXTENDED], seed + k), model) for k, b in enumerate(balances)]
    for new, old in zip(again, balances, strict=True):
        new.weights = old.weights
        new.regimes = old.regimes
    begin = whole.copy()
    begin[EXTENDED:] = 0.0
    calibration = calibrate(model, again, begin, unknowns)
    level, _ = group_means(again, calibration.fit.whole)
    level = np.maximum(level, _LOWEST) * luck(balances)
    return Floor(level, again, calibration, begin)


def weigh(balances: Sequence[Balances], floor: Float64) -> None:
    """Weigh each group by its noise floor, so that a true model leaves about 1 everywhere."""
    for b in balances:
        groups = b.judged_groups()
        weight = 1.0 / np.sqrt(np.maximum(floor, _LOWEST))
        b.weights = np.where(groups >= 0, weight[np.maximum(groups, 0)], 0.0)
