"""By how much one model errs less than another, with a bootstrap interval."""

from __future__ import annotations

import numpy as np

from etb_hil.recording.samples import Float64
from etb_hil.results.explained.errors import Gain

_DRAWS = 2000


def gain_of(before: Float64, after: Float64) -> Gain:
    """Return by what share rms errors (parts) of one model are less than another's."""
    rng = np.random.default_rng(0)
    picks = rng.integers(len(before), size=(_DRAWS, len(before)))
    drawn = 1.0 - np.sqrt((after[picks] ** 2).sum(1) / np.maximum((before[picks] ** 2).sum(1), 1e-30))
    value = 1.0 - float(np.sqrt(np.sum(after**2) / max(float(np.sum(before**2)), 1e-30)))
    low, high = np.percentile(drawn, [2.5, 97.5])
    return Gain(value, (float(low), float(high)))
