"""Score unknowns and variances of a filtered record together (Fisher's scoring)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.estimation.filtering import Column, Filtered, Normal, drive_noise, sensitivities
from etb_hil.estimation.record import Record
from etb_hil.estimation.variances import OF_VOLTAGE, VARIANCES, normal_of_variances


def scored(record: Record, at: Filtered, columns: Sequence[Column]) -> Normal:
    """Return what a filtered record knows of columns, and of the variances.

    These stand behind the columns. Each of the `VARIANCES` is in shares of what it is.
    """
    known, count = sensitivities(record, at, columns, is_kept=True), VARIANCES
    q = np.array([at.disturbance.torque**2, at.disturbance.voltage**2, at.voltage_variance])
    matrix, gradient, rows = np.zeros((count, count)), np.zeros(count), np.zeros((len(record), 3, count))
    normal_of_variances(
        record.since, record.dt, at.whitened, at.roots, at.slopes, at.gains, at.moves, at.responses, at.noises, q,
        matrix, gradient, rows,
    )  # fmt: skip
    samples = rows.shape[0] * rows.shape[1]
    across = known.rows.reshape(samples, len(columns)).T @ rows.reshape(samples, count)
    joint = np.block([[known.matrix, across], [across.T, matrix]])
    # What takes the lag of a driving reading off makes its noise larger, too.
    adds = np.eye(len(joint))
    adds[len(columns) + OF_VOLTAGE, : len(columns)] = drive_noise(record, at, columns)
    both = adds.T @ np.concatenate([known.gradient, gradient])
    return Normal(adds.T @ joint @ adds, both, np.empty((0, 3, len(both))))
