"""The motor's voltage balance window by window.

A current, voltage or angle that is wrong for a while stands out.

The first line of eq. (1) of the seed paper, in windows of 20 ms: mean voltage = R mean current + K_e G_r mean velocity
+ L d(current)/dt, with an offset and a delay of the voltage fitted along, since both differ from bench to bench.
"""

from __future__ import annotations

import numpy as np

from etb_hil.observer.normal_equations import accumulate, inverse, times
from etb_hil.recording.samples import Float64

# Columns: means of voltage V, current A and velocity rad/s, slopes of current A/s and voltage V/s, and by how much V a
# step of the voltage between two samples may have moved the mean.
WINDOW = 6
_UNKNOWNS = 5
# Detection limits: docs/reference/faults.md. No healthy unit of benchmarks/random_units.py is withheld by them.
_FEWEST = 50  # windows: a second with the bridge on
_ROUNDS = 8
_VOLTS = 0.25  # a residual below this (0.17 A, 0.06 N·m on the stock motor) moves no friction torque across a limit
_SPREAD = 8.0  # times the median residual
_ROUGH = 3.0  # times what one step of the voltage between samples may do


def worst_residual(windows: Float64) -> str | None:
    """Return in words what contradicts the motor's voltage balance, or None.

    The windows (m, 6) are those with the bridge on.
    """
    if len(windows) < _FEWEST:
        return None
    voltage = windows[:, 0]
    jacobian = np.ascontiguousarray(np.column_stack([windows[:, 1:_UNKNOWNS], np.ones(len(windows))]))
    residual = np.zeros(len(windows))
    weight = np.ones(len(windows))
    solution = np.zeros(_UNKNOWNS)
    for _ in range(_ROUNDS):
        matrix, vector = accumulate(jacobian, voltage, weight)
        solution = times(inverse(matrix), vector)
        if not np.all(np.isfinite(solution)):
            return None
        residual = np.abs(voltage - times(jacobian, solution))
        scale = max(2.0 * float(np.median(residual)), 1e-3)
        weight = np.where(residual > scale, scale / np.maximum(residual, scale), 1.0)
    allowed = max(_VOLTS, _SPREAD * float(np.median(residual))) + _ROUGH * windows[:, _UNKNOWNS]
    off = residual > allowed
    in_a_row = off[1:] & off[:-1]
    if in_a_row.any() or (residual > 2.0 * allowed).any():
        worst = float(residual[off].max())
        return (
            f"voltage, current and velocity contradict each other by up to {worst:.2f} V, for {0.02 * off.sum():.2f} s"
        )
    return None
