"""Where the plate slid slowly: T_st is that of those places and of no others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etb_hil.diagnosis.local_friction import CELL, LocalFriction
from etb_hil.diagnosis.plausibility import STOPS
from etb_hil.plant.parameters import Model, ThrottleParameters

MOST_UNSEEN = 0.1  # share of the way at a segment, 8 degrees: in more, a bump of a usual width is missed whole


@dataclass(frozen=True, slots=True)
class Unseen:
    """A segment of the way that the plate did not slide over slowly both ways.

    The segment reaches from `start` to `end` rad. `share` is its part of the way from stop to stop. `stop` rad is the
    model's stop that the plate passed in it, None where it passed none.
    """

    start: float
    end: float
    share: float
    stop: float | None = None


def seen_slowly(local: LocalFriction | None) -> tuple[float, float]:
    """Return the lowest and the highest angle in rad slid over slowly both ways.

    They are the middles of cells of a degree. Both are NaN where there is no such angle.
    """
    if local is None or not len(local.angle):
        return np.nan, np.nan
    return float(local.angle[0]), float(local.angle[-1])


def too_wide_unseen(
    local: LocalFriction | None, model: Model, throttle: ThrottleParameters, reached: tuple[float, float]
) -> Unseen | None:
    """Return the widest segment not seen, where that is too much of the way.

    None too where nothing was fitted. The way is that between the bench's stops, which may each stand further in by
    their tolerance, and wherever else the plate was: `reached` are its lowest and its highest angle in rad. Beyond the
    model's stops nothing is judged.
    """
    if local is None:
        return None
    low = min(throttle.stop_low + model.tolerance("stop_low"), reached[0])
    high = max(throttle.stop_high - model.tolerance("stop_high"), reached[1])
    starts = np.concatenate([[low], local.angle + 0.5 * CELL])
    ends = np.concatenate([local.angle - 0.5 * CELL, [high]])
    widest = int(np.argmax(ends - starts))
    start, end = float(starts[widest]), float(ends[widest])
    share = (end - start) / (high - low)
    if share <= MOST_UNSEEN:
        return None
    if start < throttle.stop_low - STOPS:
        return Unseen(start, end, share, throttle.stop_low)
    return Unseen(start, end, share, throttle.stop_high if end > throttle.stop_high + STOPS else None)
