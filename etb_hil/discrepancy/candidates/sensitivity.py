"""Sensitivity of a residual to a candidate's physical steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.candidates.candidate import Candidate
from etb_hil.discrepancy.fitting.fit import Fit, Residual

Float64 = NDArray[np.float64]


def stepped(residual: Residual, fit: Fit, candidate: Candidate) -> Float64:
    """Return how a residual changes with a physical step of each strength.

    Both have n values; the result is (n, strengths).
    """
    effect = candidate.effect
    assert effect is not None  # noqa: S101 (parameters have no shape)
    base = fit.whole.copy()
    for unknown, value, parameter in zip(candidate.unknowns, candidate.shape, effect.parameters, strict=True):
        if not parameter.is_strength:
            base[unknown.place] = value
    found = []
    for unknown, step in zip(candidate.strengths, candidate.steps, strict=True):
        moved = base.copy()
        moved[unknown.place] += step
        found.append(residual(moved) - fit.residual)
    return np.column_stack(found)
