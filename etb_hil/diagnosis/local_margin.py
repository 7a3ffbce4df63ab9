"""The return margin at each place: what the spring has over friction there.

The margin of the fitted curve is that at limp-home, where the springs are weakest. The curve does not contain a
local bump, and the plate has to pass it too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from etb_hil.diagnosis.assessment import Assessment
from etb_hil.diagnosis.contradiction import widened
from etb_hil.diagnosis.friction_model import COULOMB, DROP
from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.local_friction import CELL, OF_A_DRAG, SURE, LocalFriction
from etb_hil.diagnosis.prior import PRELOAD_CLOSE, PRELOAD_OPEN, SLOPE_CLOSE, SLOPE_OPEN
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.recording.samples import Float64


@dataclass(frozen=True, slots=True)
class Shortfall:
    """A place where the spring may have too little margin over friction.

    The place is at `angle` rad; `margin` N·m has the 95 % interval from `low` to `high`. Where `is_certain`, it is
    below `limit` N·m beyond all doubt, and `high` is the most that it may be.
    """

    margin: float
    low: float
    high: float
    limit: float
    angle: float
    is_certain: bool


def local_shortfall(
    assessment: Assessment,
    local: LocalFriction | None,
    throttle: ThrottleParameters,
    limit: float,
    band: float,
    gain: tuple[float, float],
) -> Shortfall | None:
    """Return the place of the least margin, if it may be below a limit.

    None where it is certain to be above. The marginal band counts as neither. The plate returns in one direction, and
    friction that is higher in the other one does not hold it. Certain is only what both directions show.
    """
    fit = assessment.fit
    if fit is None or local is None or not len(local.angle):
        return None
    stiction, _ = fit.stiction
    above = local.angle > throttle.limp_home
    # A torque that is even in the direction adds to the springs where it closes the plate above limp-home.
    returning = local.odd - np.where(above, local.even, -local.even)
    even = np.abs(local.even)
    one_way = (even > SURE * local.error) & (local.odd > OF_A_DRAG * even)
    most = np.where(one_way, np.maximum(local.odd, returning), local.odd)
    shown = most > SURE * local.error
    if not np.any(shown):
        return None
    q = fit.parameters
    distance = np.abs(local.angle - throttle.limp_home)
    spring = np.where(
        above,
        throttle.preload_open + q[PRELOAD_OPEN] + (throttle.slope_open + q[SLOPE_OPEN]) * distance,
        throttle.preload_close + q[PRELOAD_CLOSE] + (throttle.slope_close + q[SLOPE_CLOSE]) * distance,
    )
    most = most + _above_mean(local, most)
    place = int(np.argmin(np.where(shown, spring - most, np.inf)))
    springs = (PRELOAD_OPEN, SLOPE_OPEN) if above[place] else (PRELOAD_CLOSE, SLOPE_CLOSE)
    reach = fit.reach({springs[0]: 1.0, springs[1]: float(distance[place]), COULOMB: -1.0, DROP: -1.0})
    without = float(spring[place]) - stiction
    here, error = without - float(most[place]), float(local.error[place])
    half = math.hypot(reach, TWO_SIDED_95 * error)
    low, high = widened(here, here - half, here + half, gain)
    if low >= limit * (1.0 + band):
        return None
    angle = float(local.angle[place])
    shared, half = without - float(min(local.odd[place], returning[place])), reach + SURE * error
    surely = widened(shared, shared - half, shared + half, gain)[1]
    if even[place] <= local.odd[place] and surely < limit * (1.0 - band):
        return Shortfall(here, low, surely, limit, angle, is_certain=True)
    return Shortfall(here, low, high, limit, angle, is_certain=False)


def _above_mean(local: LocalFriction, most: Float64) -> Float64:
    """Return how far friction (b) may peak above the mean of its cell, in N·m.

    A peak with straight flanks lies above the mean of its cell by a quarter of what that lies above the cells beside.
    """
    beside = np.abs(np.diff(local.angle)) < 1.5 * CELL
    falls = np.zeros((2, len(most)))
    falls[0, 1:] = np.where(beside, most[1:] - most[:-1], 0.0)
    falls[1, :-1] = np.where(beside, most[:-1] - most[1:], 0.0)
    above: Float64 = 0.25 * np.maximum(falls.max(axis=0), 0.0)
    return above
