"""The choice that the seed paper leaves open: cut-off and M.

The choice lies between a peak that is too low and one that chatters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etb_hil.observer.gains import SlidingModeSettings
from etb_hil.paper.estimation import estimate, numbers_of, root_mean_square, without_switching
from etb_hil.paper.setups import Motion
from etb_hil.recording.samples import Float64

CUTOFFS = (15.0, 30.0, 60.0, 120.0, 250.0, 500.0, 1000.0, 2000.0)  # Hz
SWITCHING = (0.684, 1.37, 2.74, 5.47)  # N·m: four times the healthy T_st, and its doubles


@dataclass(frozen=True, slots=True)
class Trade:
    """Of one motion, by M (rows) and cut-off (columns).

    `filtered` is the highest estimate below omega_s that the filter alone would leave, `read` the one that is read,
    ripple and all, both over T_st; `ripple` the RMS of what the switching adds, `error` the RMS error with its lag,
    both over T_c.
    """

    cutoffs: Float64
    switching: Float64
    reached: float  # the highest true friction below omega_s over T_st
    filtered: Float64
    read: Float64
    ripple: Float64
    error: Float64


def trade(motion: Motion) -> Trade:
    """Return the trade of a motion."""
    throttle, counted = motion.throttle, motion.counted
    shape = (len(SWITCHING), len(CUTOFFS))
    filtered, read, ripple, error = (np.empty(shape) for _ in range(4))
    reached = 0.0
    for row, switching in enumerate(SWITCHING):
        for column, cutoff in enumerate(CUTOFFS):
            settings = SlidingModeSettings(switching, cutoff)
            explicit, implicit = estimate(motion, settings), without_switching(motion, settings)
            both = counted & np.isfinite(explicit.friction) & np.isfinite(implicit.friction)
            numbers = numbers_of(motion, explicit)
            reached = numbers.reached / throttle.stiction
            read[row, column] = numbers.stiction / throttle.stiction
            filtered[row, column] = numbers_of(motion, implicit).stiction / throttle.stiction
            ripple[row, column] = root_mean_square((explicit.friction - implicit.friction)[both]) / throttle.coulomb
            error[row, column] = numbers.error / throttle.coulomb
    return Trade(np.array(CUTOFFS), np.array(SWITCHING), reached, filtered, read, ripple, error)
