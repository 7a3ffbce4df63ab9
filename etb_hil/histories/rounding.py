"""The rounding of means: differences that are none."""

from __future__ import annotations

import numpy as np

from etb_hil.recording.samples import Float64

# Of the largest value: a mean of a million equal values is off by less (Higham 1993), and no bench resolves as much.
_SHARE = 1e-12


def without_rounding(differences: Float64, values: Float64) -> Float64:
    """Return differences with 0 in place of what rounding leaves.

    They are between values, or of values and their means.

    `values` are those that they were formed of, both in the same unit. Shapes may differ.
    """
    least = _SHARE * float(np.abs(values).max(initial=0.0))
    return np.where(np.abs(differences) <= least, 0.0, differences)


def scatters(values: Float64) -> bool:
    """Return whether values differ by more than rounding."""
    return bool(without_rounding(np.array(np.ptp(values)), values))
