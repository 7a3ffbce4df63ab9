"""The noise floor of the case at hand, from a simulation of the calibrated model.

The simulation passes the same balances and calibration. A fixed noise floor does not work: nearly at rest and on the
stops it varies twentyfold between devices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration, calibrate
from etb_hil.discrepancy.fitting.rerun import along_the_motion, read_by_sensors
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector
from etb_hil.recording.samples import Float64

GROUPS = 9  # 3 balances by 3 regimes
_LOWEST = 0.05  # below it a noise floor is sampling variance: noise alone leaves more
LEAST_SAMPLES = 25  # of a group that is judged: 0.1 s
# Decision 0029. Healthy units by these: benchmarks/explain_study.py, kind `nothing`, --view coarse_encoder.
_MATTERS = 0.1  # of a balance's noise, from where an encoder's steps are looked at
_SURE = 3.0  # standard deviations
_SPREAD = 1.6  # times their mean squared: the variance by which two mean squares of one reading each are apart


@dataclass(frozen=True, slots=True)
class NoiseFloor:
    """Mean square (9) by group that a true model may leave, unweighted, and its rerun.

    `truth`: the whole vector that was simulated; the distance of the rerun's calibration from it shows how well it is
    identified. `motions`: see `motions_of`.
    """

    level: Float64
    balances: list[Balances]
    calibration: Calibration
    truth: Vector
    motions: list[Float64]


def group_means(balances: Sequence[Balances], whole: Vector) -> tuple[Float64, NDArray[np.int64]]:
    """Return mean squares (9) of the unweighted residual by group, and counts (9)."""
    total, count = np.zeros(GROUPS), np.zeros(GROUPS, np.int64)
    for b in balances:
        left = np.concatenate(b.channels(whole[:EXTENDED], whole[EXTENDED:]))
        groups = b.judged_groups()
        inside = groups >= 0
        total += np.bincount(groups[inside], left[inside] ** 2, GROUPS)
        count += np.bincount(groups[inside], minlength=GROUPS)
    return total / np.maximum(count, 1), count


def noise_floor_of(
    model: Model, balances: Sequence[Balances], whole: Vector, unknowns: Sequence[Unknown]
) -> NoiseFloor:
    """Return the noise floor of the model at `whole`: simulated, measured, refitted."""
    motions = motions_of(balances, whole)
    again = simulated(model, balances, whole, motions)
    begin = whole.copy()
    begin[EXTENDED:] = 0.0
    calibration = calibrate(model, again, begin, unknowns)
    level, _ = group_means(again, calibration.fit.whole)
    level = np.maximum(level, _LOWEST) * quantisation_spread(balances)
    return NoiseFloor(level, again, calibration, begin, motions)


def motions_of(balances: Sequence[Balances], whole: Vector) -> list[Float64]:
    """Return the motion of the model at `whole` along each segment, without noise."""
    return [along_the_motion(b, whole[:EXTENDED]) for b in balances]


def simulated(
    model: Model, balances: Sequence[Balances], whole: Vector, motions: Sequence[Float64], seed: int = 1
) -> list[Balances]:
    """Return the balances of a simulation of the model at `whole`, judged likewise.

    `motions`: those of `motions_of`, which the sensors read with other noise by each `seed`.
    """
    read = [
        read_by_sensors(b, whole[:EXTENDED], motion, seed + k)
        for k, (b, motion) in enumerate(zip(balances, motions, strict=True))
    ]
    again = [Balances(one, model) for one in read]
    for new, old in zip(again, balances, strict=True):
        new.weights = old.weights
        new.regimes = old.regimes
    return again


def weigh(balances: Sequence[Balances], noise_floor: Float64) -> None:
    """Weigh each group by its noise floor, so that a true model leaves about 1."""
    for b in balances:
        groups = b.judged_groups()
        weight = 1.0 / np.sqrt(np.maximum(noise_floor, _LOWEST))
        b.weights = np.where(groups >= 0, weight[np.maximum(groups, 0)], 0.0)


def quantisation_spread(balances: Sequence[Balances]) -> Float64:
    """Return the factor (9) between two true models' mean squares by group; 1 if fine.

    At rest an encoder is off by the same part of a step all the time. A dozen rests are a dozen readings, however many
    samples they have: one simulation shows little of what the unit leaves. That holds for a velocity, too: a plate held
    next to an edge steps to and fro.
    """
    shares = np.max([b.share_of_steps for b in balances], axis=0)
    shares = np.where(shares > _MATTERS, shares, 0.0)
    samples, squares = sum((_samples(b) for b in balances), np.zeros((2, 9)))
    return np.asarray(1.0 + _SURE * np.repeat(shares, 3) * np.sqrt(_SPREAD * squares) / np.maximum(samples, 1.0))


def _samples(balances: Balances) -> Float64:
    """Return by group (2, 9) the judged samples, and the sum of squared run lengths.

    A run is the samples of one rest: they have one angle.
    """
    steps = np.abs(np.diff(balances.spectrum.picked(balances.measured.angle), prepend=np.nan)) > 0.0
    place = np.cumsum(steps)
    found = np.zeros((2, 9))
    for channel, groups in enumerate(np.split(balances.judged_groups(), 3)):
        for group in range(3 * channel, 3 * channel + 3):
            each = np.bincount(place[groups == group]).astype(np.float64)
            found[:, group] = each.sum(), each @ each
    return found
