"""Friction over position and temperature, relative to the fitted curve.

The map shows where friction is locally higher, and by how much.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.reference_temperature import REFERENCE_TEMPERATURE
from etb_hil.diagnosis.windows import NARROW
from etb_hil.recording.samples import Float64, Int64

CELL = 0.035  # rad, 2 deg: what a window of 17 ms resolves at up to 2 rad/s
TEMPERATURE_CELL = 10.0  # K
FASTEST = 2.0  # rad/s: a faster window smears over more than a cell

_FEWEST = 4  # windows a cell and direction
_LEAST_EXCESS = 0.1  # share of the friction that counts as a bump
_LOW = 2  # cells on either side of a bump: in the last one of a way friction turns round
_CLEAR = 4.0  # standard errors that a bump stands out by


@dataclass(frozen=True, slots=True)
class FrictionMap:
    """Friction as a factor on the fitted curve.

    `angle` (b) rad and `temperature` (t) degC are the middles of the cells; `factor` (t, b) and its standard `error`
    (t, b), NaN where the plate did not slide in both directions.
    """

    angle: Float64
    temperature: Float64
    factor: Float64
    error: Float64


@dataclass(frozen=True, slots=True)
class Bump:
    """A bump: a part of the way where friction is locally higher.

    The bump reaches from `start` to `end` rad. Friction is highest at `angle` rad, by `excess` (a share).
    """

    start: float
    end: float
    angle: float
    excess: float


def friction_map(runs: Sequence[Mapping[str, Float64]]) -> FrictionMap:
    """Return the friction map of one unit, from the `series` of its results.

    They may have been taken at any temperatures. Windows are narrow where a run has no `point_overlap`.

    Raises ValueError where no run has slow points behind a fit. Friction is odd in the direction of motion: the mean
    over both directions takes out what the springs' model has wrong at a place. Without a temperature, it counts as
    20 degC.
    """
    fitted = [run for run in runs if "point_excess" in run]
    if not fitted:
        raise ValueError("no run has a fitted friction curve to map")
    angle, velocity, excess, temperature = (
        np.concatenate([run[name] for run in fitted])
        for name in ("point_angle", "point_velocity", "point_excess", "point_temperature")
    )
    overlap = np.concatenate(
        [run.get("point_overlap", np.full(len(run["point_angle"]), NARROW.overlap)) for run in fitted]
    )
    temperature = np.where(np.isnan(temperature), REFERENCE_TEMPERATURE, temperature)
    slow = np.abs(velocity) < FASTEST
    if not np.any(slow):
        raise ValueError("no run has windows slow enough to distinguish places")
    column = np.floor(angle[slow] / CELL).astype(np.int64)
    row = np.floor(temperature[slow] / TEMPERATURE_CELL).astype(np.int64)
    columns, rows = np.arange(column.min(), column.max() + 1), np.arange(row.min(), row.max() + 1)
    factor, error = np.empty((len(rows), len(columns))), np.empty((len(rows), len(columns)))
    _fill(row - rows[0], column - columns[0], velocity[slow], excess[slow], overlap[slow], factor, error)
    return FrictionMap((columns + 0.5) * CELL, (rows + 0.5) * TEMPERATURE_CELL, factor, error)


def find_bumps(over: FrictionMap) -> list[Bump]:
    """Return the bumps of a friction map, at any temperature.

    Friction stands out there by more than a tenth and by four standard errors. A bump falls by half and more on both
    sides: friction that only rises along the way is none.
    """
    bumps: list[Bump] = []
    for factor, error in zip(over.factor, over.error, strict=True):
        high = (factor - 1.0 > _LEAST_EXCESS) & (factor - 1.0 > _CLEAR * error)
        start = None
        for k in range(len(high) + 1):
            if k < len(high) and high[k]:
                start = k if start is None else start
            elif start is not None:
                top = start + int(np.argmax(factor[start:k]))
                middle, half = float(over.angle[top]), 0.5 * CELL
                edges = (float(over.angle[start]) - half, float(over.angle[k - 1]) + half)
                if _falls(factor[:top], factor[top]) and _falls(factor[top + 1 :], factor[top]):
                    bumps.append(Bump(*edges, middle, float(factor[top]) - 1.0))
                start = None
    return bumps


def _falls(side: Float64, top: float) -> bool:
    """Return whether friction falls to half of a bump or less on one side of it."""
    return int(np.count_nonzero(side - 1.0 < 0.5 * (top - 1.0))) >= _LOW


@njit(cache=True, error_model="numpy")
def _fill(
    row: Int64, column: Int64, velocity: Float64, excess: Float64, overlap: Float64, factor: Float64, error: Float64
) -> None:
    count, overlaps = np.zeros((2, *factor.shape)), np.zeros((2, *factor.shape))
    total, square = np.zeros((2, *factor.shape)), np.zeros((2, *factor.shape))
    for k in range(len(row)):
        way = 0 if velocity[k] > 0.0 else 1
        count[way, row[k], column[k]] += 1.0
        overlaps[way, row[k], column[k]] += overlap[k]
        total[way, row[k], column[k]] += excess[k]
        square[way, row[k], column[k]] += excess[k] * excess[k]
    for r in range(factor.shape[0]):
        for c in range(factor.shape[1]):
            factor[r, c] = error[r, c] = np.nan
            if count[0, r, c] < _FEWEST or count[1, r, c] < _FEWEST:
                continue
            mean, variance = 0.0, 0.0
            for way in range(2):
                n = count[way, r, c]
                middle = total[way, r, c] / n
                mean += 0.5 * middle
                overlapping = overlaps[way, r, c] / n
                variance += 0.25 * overlapping * max(square[way, r, c] / n - middle * middle, 0.0) / n
            factor[r, c], error[r, c] = 1.0 + mean, math.sqrt(variance)
