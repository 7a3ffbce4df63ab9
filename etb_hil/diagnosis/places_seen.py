"""How much of the way the plate slid over slowly: T_st is that of those places and of no others."""

from __future__ import annotations

import numpy as np

from etb_hil.diagnosis.local_friction import CELL, LocalFriction
from etb_hil.diagnosis.stribeck_fit import Evidence

ENOUGH = 0.5  # share of the way
OF_SLOW_FRICTION = frozenset({"T_st", "return_margin"})


def share_seen_slowly(evidence: Evidence, local: LocalFriction | None) -> float:
    """Return the share of the way under the windows that slow ones passed in both directions; 1 without a fit."""
    if local is None:
        return 1.0
    way = float(np.ptp(evidence.position))
    return len(local.angle) * CELL / max(way, CELL)
