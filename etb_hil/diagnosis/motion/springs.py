"""The springs' torque over the angle.

The torque is the mean of what opening and closing take at one slow speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.student import student
from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.interval import Interval
from etb_hil.diagnosis.measurement_kind import Estimate
from etb_hil.diagnosis.motion.passes import Bins, presliding, slow_passes
from etb_hil.diagnosis.prior import CONSTANT

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings

_BIN = math.radians(0.25)
_FEWEST = 4  # bins on a side
_CLEAR = math.radians(0.4)  # of limp-home's jump, half a bin and the encoder's zero included
# Share of the way over which friction turns round to a three-thousandth. The plate jumps at limp-home, where friction
# falls from T_st towards T_c: up to a tenth of turning round. After this share of the way a hundredth is left of it.
_JUMPED = math.log(100.0) / math.log(3000.0)


@dataclass(frozen=True, slots=True)
class SpringLine:
    """The spring on one side of limp-home.

    The spring has its torque there in N·m and its slope in N·m/rad.
    """

    torque: Estimate
    slope: Estimate


def spring_line(run: Findings, *, is_above: bool) -> SpringLine | None:
    """Return the line through the springs' torque on one side of limp-home.

    None where too little of that side was passed.
    """
    throttle, model = run.throttle, run.model
    bins = run.once(_current)
    clear = throttle.dead_zone + model.tolerance("dead_zone") + model.tolerance("limp_home") + _CLEAR
    clear += _JUMPED * presliding(run)
    away = 0.5 * (bins.angle[0] + bins.angle[1]) - throttle.limp_home
    side = away > clear if is_above else away < -clear
    if np.count_nonzero(side) < _FEWEST:
        return None
    sign = 1.0 if is_above else -1.0
    constant, nominal, fit = run.scale * throttle.torque_per_ampere, throttle.torque_per_ampere, run.assessment.fit
    share = (
        model.tolerance("torque_per_ampere") / nominal / math.sqrt(3.0) if fit is None else fit.error({CONSTANT: 1.0})
    )
    distance, torque = sign * away[side], sign * constant * 0.5 * (bins.value[0] + bins.value[1])[side]
    count, middle = len(distance), float(np.mean(distance))
    apart = distance - middle
    square = float(np.sum(apart * apart))
    slope = float(np.sum(apart * torque)) / square
    mean = float(np.mean(torque))
    residual = torque - mean - slope * apart
    scatter = math.sqrt(float(np.sum(residual * residual)) / (count - 2)) * float(student(count - 2)) / TWO_SIDED_95
    at_zero = mean - slope * middle
    errors = scatter * math.sqrt(1.0 / count + middle * middle / square), scatter / math.sqrt(square)
    note = f"{count} bins of 0.25 deg, {math.degrees(float(np.min(distance))):.1f} to "
    note += f"{math.degrees(float(np.max(distance))):.1f} deg from limp-home"
    found = []
    for value, error in zip((at_zero, slope), errors, strict=True):
        reach = TWO_SIDED_95 * math.hypot(error, share * value)
        found.append(run.with_gain(Interval(value, value - reach, value + reach), note=note))
    return SpringLine(*found)


def _current(run: Findings) -> Bins:
    return slow_passes(run.of("ramp"), "motor_current", _BIN, presliding(run))
