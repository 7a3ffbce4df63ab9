"""The residual of the fitted curve, place by place.

Friction is odd in the direction of motion, springs are even.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.diagnosis.evidence import Evidence
from etb_hil.diagnosis.friction_map import FASTEST
from etb_hil.diagnosis.prior import CONSTANT
from etb_hil.diagnosis.stribeck_fit import StribeckFit
from etb_hil.recording.samples import Float64, Int64

CELL = 0.0175  # rad, 1 deg
SURE = 3.0  # standard errors by which friction at a place is higher; false fails by it: benchmarks/random_units.py
OF_A_DRAG = 0.5  # of what is even so much is odd at least, halfway between a drag in one direction and a spring

_FEWEST = 5  # windows a cell and direction: 16 ms and more each way


@dataclass(frozen=True, slots=True)
class LocalFriction:
    """Cells in which the plate slid slowly both ways, by `angle` (b) rad.

    `odd` (b) N·m, friction above the fitted curve; `even` (b) N·m, torque that the bench's model does not know of;
    `error` (b) N·m, the standard error of both.
    """

    angle: Float64
    odd: Float64
    even: Float64
    error: Float64


def local_friction(evidence: Evidence, fit: StribeckFit, *, slides: bool = False) -> LocalFriction:
    """Return the mean residual of the fit in each cell.

    With `slides` windows in which bristles may bend are left out. By such windows friction that is higher at a turning
    point seems to push: in the direction in which the plate turned back, bristles have yet to bend.
    """
    slow = np.abs(evidence.velocity) < FASTEST
    if slides:
        slow &= evidence.slides
    residual = fit.residual[slow] * (1.0 + fit.parameters[CONSTANT])
    parts = local_means(evidence.position[slow], evidence.velocity[slow], residual, evidence.overlap)
    return LocalFriction(*parts)


def local_means(
    position: Float64, velocity: Float64, values: Float64, overlap: float
) -> tuple[Float64, Float64, Float64, Float64]:
    """Return the odd and the even part of values (m), cell by cell.

    The results (b) are the middles of the cells in rad, both parts, and their standard error. The parts are odd and
    even in the velocity (m). Cells that were not passed often enough in both directions are left out.
    """
    if not len(position):
        none = np.empty(0)
        return none, none, none, none
    column = np.floor(position / CELL).astype(np.int64)
    columns = np.arange(column.min(), column.max() + 1)
    out = np.empty((3, len(columns)))
    _parts(column - columns[0], velocity, values, overlap, out)
    known = np.isfinite(out[0])
    odd, even, error = out[:, known]
    return (columns[known] + 0.5) * CELL, odd, even, error


@njit(cache=True, error_model="numpy")
def _parts(column: Int64, velocity: Float64, residual: Float64, overlap: float, out: Float64) -> None:
    cells = out.shape[1]
    count, total, square = np.zeros((2, cells)), np.zeros((2, cells)), np.zeros((2, cells))
    for k in range(len(column)):
        way = 0 if velocity[k] > 0.0 else 1
        count[way, column[k]] += 1.0
        total[way, column[k]] += residual[k]
        square[way, column[k]] += residual[k] * residual[k]
    for c in range(cells):
        out[:, c] = np.nan
        if count[0, c] < _FEWEST or count[1, c] < _FEWEST:
            continue
        variance = 0.0
        for way in range(2):
            middle = total[way, c] / count[way, c]
            spread = max(square[way, c] / count[way, c] - middle * middle, 0.0)
            variance += 0.25 * overlap * spread / count[way, c]
        opening, closing = total[0, c] / count[0, c], total[1, c] / count[1, c]
        out[0, c], out[1, c], out[2, c] = 0.5 * (opening - closing), 0.5 * (opening + closing), math.sqrt(variance)
