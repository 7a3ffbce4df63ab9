"""Student's distribution: what an error estimated from few values stays within."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Two-sided 95 % quantiles over one by the degrees of freedom (ISO 2602); lines between them are within 0.2 %.
_ONE_OVER = (0.0, 1 / 40, 1 / 20, 1 / 12, 1 / 8, 1 / 6, 1 / 5, 1 / 4, 1 / 3, 1 / 2.5, 1 / 2, 1 / 1.5, 1.0)
_QUANTILES = (1.960, 2.021, 2.086, 2.179, 2.306, 2.447, 2.571, 2.776, 3.182, 3.558, 4.303, 6.125, 12.706)


def student(degrees: float | NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Student's two-sided 95 % quantile for degrees of freedom.

    They have any shape, and are 1 at least.
    """
    return np.interp(1.0 / np.maximum(np.asarray(degrees, np.float64), 1.0), _ONE_OVER, _QUANTILES)
