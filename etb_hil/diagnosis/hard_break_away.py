"""Break-aways from rest that take more torque than the fitted curve has.

An opening break-away and the closing one after it turn friction round against the same spring: what is wrong with the
spring cancels in their mean. The hardest pair counts, since a mean over places would hide one that sticks. What a place
has in sliding as well, as a bump, is no matter of break-away.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from etb_hil.diagnosis.break_away import READING, BreakAway
from etb_hil.diagnosis.evidence import Evidence
from etb_hil.diagnosis.friction_map import FASTEST
from etb_hil.diagnosis.friction_model import AGEING, grown_at_rest
from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.interval import Interval
from etb_hil.diagnosis.local_friction import CELL, SURE, local_means
from etb_hil.diagnosis.prior import ANY_AGEING, CONSTANT
from etb_hil.diagnosis.result import Reason
from etb_hil.diagnosis.stribeck_fit import StribeckFit

_CREEPS = 0.2  # rad/s, half the speed of the stock checks' slow ramps: slower windows are of the break-aways themselves
_NEAR = 0.17  # rad, 10 deg: slopes of springs that are off by a fifth differ by 2 mN·m from end to end


@dataclass(frozen=True, slots=True)
class HardBreakAway:
    """The pair of break-aways that took most beyond sliding at its place.

    It reaches `above` N·m beyond the interval of T_st, 0 where they agree. T_st is `least` at least: what the pair took
    beyond sliding at its place, its lower end without what a rest may have added. `reason` says that the pair leaves
    T_st open; None where it agrees, or contacts that age, by the fitted law, explain it.
    """

    above: float
    least: Interval
    reason: Reason | None

    def of_stiction(self, curve: Interval, broke: Interval) -> Interval:
        """Return the interval of T_st, by the curve's and the break-away's.

        `broke` is `least`, as wide as an uneven way makes it.
        """
        low = max(curve.low, broke.low)
        if self.reason is not None:
            return Interval(max(broke.value, low), low, broke.high)
        high = curve.high + self.above
        return Interval(curve.value if low <= curve.value else min(max(broke.value, low), high), low, high)


def pairs_of(found: Sequence[BreakAway], limp_home: float) -> list[tuple[BreakAway, BreakAway]]:
    """Return break-aways that open, each with the one after it.

    That one closes near the same place, against the same spring.
    """
    return [
        (opening, closing)
        for opening, closing in pairwise(found)
        if opening.direction > closing.direction
        and (opening.angle - limp_home) * (closing.angle - limp_home) > 0.0
        and abs(opening.angle - closing.angle) < _NEAR
    ]


def hard_break_away(
    pairs: Sequence[tuple[BreakAway, BreakAway]], evidence: Evidence, fit: StribeckFit, stiction: Interval
) -> HardBreakAway | None:
    """Return what the hardest pair says of T_st, None without a pair."""
    if not pairs:
        return None
    seen = [_local(evidence, fit, one.angle, other.angle) for one, other in pairs]
    local = [0.0 if one is None else one for one in seen]
    torques = [0.5 * (one.torque + other.torque) for one, other in pairs]
    hardest = max(range(len(pairs)), key=lambda k: torques[k] - local[k])
    torque, (one, other) = torques[hardest], pairs[hardest]
    low, high, rest = torque * (1.0 - READING), torque * (1.0 + READING), max(one.rest, other.rest)
    least = Interval(torque, -math.inf, high)  # nobody knows what sliding at that place takes
    if seen[hardest] is not None:
        aged = fit.parameters.copy()
        aged[AGEING] = max(aged[AGEING], TWO_SIDED_95 * ANY_AGEING * min(stiction.high, torque))
        share = math.hypot(READING, fit.reach({CONSTANT: 1.0}))
        bottom = torque * (1.0 - share) - local[hardest] - grown_at_rest(rest, aged)
        least = Interval(torque - local[hardest], bottom, high)
    here = stiction.high + local[hardest]
    if low <= here:
        return HardBreakAway(0.0, least, None)
    most, reason = here + grown_at_rest(rest, fit.parameters), None
    if low > most:
        text = f"the plate broke away at {torque:.3f} N·m, and the fitted curve has {most:.3f} at most"
        reason = Reason("break_away_above", f"{text}: in slower motion, or after a longer rest, it may take more")
    return HardBreakAway(high - stiction.high, least, reason)


def unread(pairs: Sequence[tuple[BreakAway, BreakAway]], phases: Collection[str]) -> list[Reason]:
    """Return a remark where a run has a phase for break-aways, and no pair of them."""
    if "break_away" not in phases or pairs:
        return []
    text = "the plate was nowhere seen to break away from a rest in both directions: T_st is the curve's alone"
    return [Reason("break_away_not_read", text)]


def _local(evidence: Evidence, fit: StribeckFit, start: float, end: float) -> float | None:
    """Return by how many N·m faster sliding may be above the curve.

    It is seen between two angles, in rad; None where it is not seen there.
    """
    speed = np.abs(evidence.velocity)
    faster = (speed > _CREEPS) & (speed < FASTEST)
    residual = fit.residual[faster] * (1.0 + fit.parameters[CONSTANT])
    angle, odd, _, error = local_means(evidence.position[faster], evidence.velocity[faster], residual, evidence.overlap)
    near = (angle > min(start, end) - CELL) & (angle < max(start, end) + CELL)
    if not np.any(near):
        return None
    return float(max((odd + SURE * error)[near].max(), 0.0))
