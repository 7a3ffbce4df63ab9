"""How much of the way the plate slid over slowly: T_st is that of those places and of no others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from etb_hil.base.outcome import UnitVerdict
from etb_hil.diagnosis.local_friction import CELL, LocalFriction
from etb_hil.diagnosis.result import Number
from etb_hil.diagnosis.stribeck_fit import Evidence

ENOUGH = 0.5  # share of the way
OF_SLOW_FRICTION = frozenset({"T_st", "return_margin"})


def share_seen_slowly(evidence: Evidence, local: LocalFriction | None) -> float:
    """Return the share of the way under the windows that slow ones passed in both directions; 1 without a fit."""
    if local is None:
        return 1.0
    way = float(np.ptp(evidence.position))
    return len(local.angle) * CELL / max(way, CELL)


def judged_where_seen(numbers: Sequence[Number], share: float) -> tuple[Number, ...]:
    """Return the numbers, of which those that hang on T_st do not pass where the `share` of the way seen is too small.

    Beyond a limit they fail all the same: no other place makes up for that.
    """
    if share >= ENOUGH:
        return tuple(numbers)
    return tuple(
        replace(number, verdict=UnitVerdict.INCONCLUSIVE)
        if number.id in OF_SLOW_FRICTION and number.verdict is UnitVerdict.PASS
        else number
        for number in numbers
    )
