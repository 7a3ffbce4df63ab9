"""Rejection criteria for the best candidate of a selection step.

Every candidate reduces the residual a little, even if the model is complete.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.candidates.refinement import LEAST_BEYOND, LEAST_GAIN
from etb_hil.discrepancy.fitting.noise_floor import LEAST_SAMPLES
from etb_hil.discrepancy.search.decision import REJECTING, THRESHOLD, UNTOUCHED, rejects
from etb_hil.discrepancy.search.findings import Findings, SelectionStep, siblings
from etb_hil.plant.effects.port import Port

RejectionCriterion = Callable[[SelectionStep, Findings], str]

# Decision 0030. Rates of right and wrong names by these thresholds: benchmarks/explain_study.py, kinds `strong`,
# `pair`, `outside` and `removed`.
_HEALTHY_TIMES = 2.0  # times what the winner gains on the model's own simulation
_LATER_GAIN = 0.25  # of the residual sum of squares with the earlier causes
_LATER_T = 4.0  # over the held-out segments
_LATER_CERTAIN = 0.8  # of the residual: a candidate that explains as much is accepted beside similar ones
_LATER_CLEAR = (
    1.5  # least ratio of a competitor's residual to the winner's where base parameters explain nearly as much
)
_LATER_MOST = 0.5  # of the excess over the noise floor: a later cause that explains less needs _LATER_CLEAR
_LATER_PARAMETER = 0.5  # least gain of a parameter after an effect: a smaller one may be the effect's error of shape
# Reduction by chance, in units of a group's noise floor: torque, voltage, angle; each on a stop, slow, sliding.
GROUP_GAIN = np.array([4.0, 1.0, 0.25, 1.2, 0.12, 0.35, 0.4, 0.12, 0.2])
# Share that a cause may raise a group by; the torque balance is left out: its groups share one friction.
_GROUP_LOSS = np.array([np.inf, np.inf, np.inf, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2])
_VOLTAGE = slice(3, 6)
_CERTAIN_GAIN = 0.5
_CONCENTRATED = 0.33
_NEARLY_NOISE_FLOOR = 1.2
_LEAST_T = 1.5  # over the held-out segments
_LATE = 0.2  # least sum of delay and lag, of the larger one; true ones have 0.6 and more
_LOCAL = 0.25  # largest half width of a local effect, of the range of the motion
_WHOLE = 0.1  # largest distance of an order from a whole number; true ones are found within 0.004


def reason_to_reject(found: SelectionStep, findings: Findings) -> str:
    """Return the first reason to reject a step's winner; empty if it is accepted."""
    return next((words for criterion in _CRITERIA if (words := criterion(found, findings))), "")


def is_open(found: SelectionStep, findings: Findings, *also: RejectionCriterion) -> bool:
    """Tell whether only criteria that a missing cause may trigger reject a winner.

    `also`: further criteria that a compensating cause may trigger.
    """
    reasons = {criterion for criterion in _CRITERIA if criterion(found, findings)}
    return bool(reasons) and reasons <= {_harms_a_balance, fails_on_other_segments, *also}


def is_rejected_as_shared_only(found: SelectionStep, findings: Findings) -> bool:
    """Tell whether a winner is rejected only because another may explain the same."""
    return {criterion for criterion in _CRITERIA if criterion(found, findings)} == {is_one_of_several}


def explains_nearly_all(found: SelectionStep, findings: Findings) -> bool:
    """Tell whether a winner explains nearly all that can be explained."""
    return found.gain > _CERTAIN_GAIN and _share_over_noise_floor(found, findings) > _LATER_CERTAIN


def harms(before: NDArray[np.float64], after: NDArray[np.float64], findings: Findings) -> bool:
    """Tell whether a balance is worse with causes; mean squares over noise by group."""
    # A true cause increases the residual of no balance: weaker magnets change torque and back-EMF. A candidate that
    # reduces the torque's residual and increases the voltage's is not the cause.
    is_harmed = after - before > _GROUP_LOSS * np.maximum(before, 1.0)
    return bool((is_harmed & _judged(findings)).any())


def _repeats_an_earlier_cause(found: SelectionStep, findings: Findings) -> str:
    if not findings.accepted:
        return ""
    explains_all = explains_nearly_all(found, findings)
    if not explains_all and _is_on_bound(found):
        return "its strength is on a bound: it approximates another effect"
    if not explains_all and found.winner.id in siblings(findings.accepted):
        return "is similar to an accepted cause, whose error of shape may be the residual"
    return ""


def is_ambiguous_with_a_cause(found: SelectionStep, findings: Findings) -> str:
    """Reject a winner that is in one ambiguity group with an earlier cause."""
    if any(r.winner.id in found.ambiguity_group or found.winner.id in r.ambiguity_group for r in findings.accepted):
        return "is not isolable from an accepted cause"
    return ""


def is_collinear_with_base(found: SelectionStep, findings: Findings) -> str:
    """Reject a later cause collinear with base parameters, unless it explains most."""
    # Several candidates explain a residual that base parameters nearly explain. Only one that explains much more than
    # all others is accepted.
    if not findings.accepted or explains_nearly_all(found, findings) or _is_clear(found):
        return ""
    if any(name.startswith("parameter:") for name in found.ambiguity_group):
        return "base parameters and other candidates explain nearly as much"
    return ""


def _explains_too_little(found: SelectionStep, findings: Findings) -> str:
    least = LEAST_GAIN + _HEALTHY_TIMES * found.healthy_gain
    if findings.accepted:
        # The residual after a cause may be the difference between the unit's shape and the catalogue's.
        is_its_own = found.t >= _LATER_T or (_brought_down(found) & _untouched(findings)).any()
        least = max(least, 2.0 * LEAST_GAIN if is_its_own else _LATER_GAIN)
        if found.winner.candidate.frees:
            least = max(least, _LATER_PARAMETER)
    if found.gain > least:
        return ""
    return f"explains {100.0 * found.gain:.1f} % of the residual; at least {100.0 * least:.1f} % is required"


def is_one_of_several(found: SelectionStep, findings: Findings) -> str:
    """Reject a later cause that explains a minor part, as others nearly do."""
    # Several catalogue effects together fit the residual of one effect that is not in the catalogue, each a part of it.
    # A true cause explains most of the residual, or more than every other candidate.
    if not findings.accepted or _share_over_noise_floor(found, findings) > _LATER_MOST or _is_clear(found):
        return ""
    return "explains less than half of the residual, and other candidates explain nearly as much"


def is_third(found: SelectionStep, findings: Findings) -> str:
    """Reject a third cause that is not significant in cross-validation."""
    # The errors of shape of two causes leave a small residual, which some third candidate fits.
    if len(findings.accepted) < 2 or found.t > _LATER_T:
        return ""
    return f"a third cause needs t above {_LATER_T:g} in cross-validation; its t is {found.t:.1f}"


def _helps_no_balance(found: SelectionStep, findings: Findings) -> str:
    is_helped = found.before_groups - found.after_groups > GROUP_GAIN
    return "" if (is_helped & _judged(findings)).any() else "reduces no balance's residual significantly"


def _harms_a_balance(found: SelectionStep, findings: Findings) -> str:
    is_harmed = harms(found.before_groups, found.after_groups, findings)
    return "increases the residual of another balance" if is_harmed else ""


def _lacks_its_back_emf(found: SelectionStep, findings: Findings) -> str:
    # Torque constant and back-EMF constant are one: weaker magnets reduce the residual of the voltage balance, too.
    effect = found.winner.candidate.effect
    if effect is None or not effect.is_of_one_motor_constant:
        return ""
    samples = np.where(_judged(findings), findings.samples, 0)[_VOLTAGE]
    before, after = samples @ found.before_groups[_VOLTAGE], samples @ found.after_groups[_VOLTAGE]
    return "the back-EMF does not change with it" if after > before else ""


def fails_on_other_segments(found: SelectionStep, findings: Findings) -> str:
    """Reject a winner whose gain does not hold in cross-validation."""
    # A cause that acts in few segments has a small t, however certain it is. So t is required of small gains only, and
    # of none that reduce a group from over its threshold to the noise floor.
    if found.t > _LEAST_T or found.gain > _CERTAIN_GAIN or (_brought_down(found) & _judged(findings)).any():
        return ""
    return f"is not significant in cross-validation: t is {found.t:.1f}, {_LEAST_T:g} is required"


def is_not_late(found: SelectionStep, _: Findings) -> str:
    """Reject a delay and a lag that together make the current no later."""
    # A current that comes before its cause means that the angles are late. A filter on all channels is no delay.
    winner = found.winner
    effect = winner.candidate.effect
    if effect is None or not effect.acts_at(Port.CURRENT_LATENESS):
        return ""
    delay, lag = (float(winner.fit.whole[effect.indices[k]]) for k in effect.strengths)
    if delay + lag > _LATE * max(abs(delay), abs(lag)):
        return ""
    return "its delay and lag cancel: the angles may be late, or all channels have the same filter"


def has_impossible_sign(found: SelectionStep, _: Findings) -> str:
    """Reject a strength below zero that cannot be negative."""
    # A negative strength has no physical meaning here: the fit approximates another effect.
    winner = found.winner
    effect = winner.candidate.effect
    if effect is None or not effect.is_one_way:
        return ""
    strengths = [winner.fit.whole[effect.indices[k]] for k in effect.strengths]
    return "its strength is negative; this effect allows positive strengths only" if sum(strengths) < 0.0 else ""


def _is_on_bound_without_need(found: SelectionStep, findings: Findings) -> str:
    # No group exceeds its threshold, and the strength is at its bound: the fit follows differences between devices.
    if _is_on_bound(found) and not rejects(found.before_groups, _judged(findings)):
        return "its strength is on a bound, and no balance exceeds its threshold"
    return ""


def has_no_full_period(found: SelectionStep, _: Findings) -> str:
    """Reject a wave whose period is the longest allowed."""
    # A part of a period fits any smooth curve.
    effect = found.winner.candidate.effect
    orders = [] if effect is None else [u for u in found.winner.unknowns if u.place in effect.orders]
    if any(u.x_of(found.winner.fit.whole) <= u.low + 1e-6 for u in orders):
        return "its period is longer than the recorded range: it approximates another curve"
    return ""


def has_no_whole_order(found: SelectionStep, findings: Findings) -> str:
    """Reject a motor's wave that has no whole number of periods a turn."""
    # A motor has a whole number of slots, poles and bars a turn. A drive's turn is not its motor's.
    winner, effect = found.winner, found.winner.candidate.effect
    if effect is None or findings.balances[0].measured.is_drive:
        return ""
    orders = [float(winner.fit.whole[u.place]) for u in winner.unknowns if u.place in effect.counts]
    if any(abs(order - round(order)) > _WHOLE for order in orders):
        return f"its order is {orders[0]:.3g} a motor turn; slots and poles give whole orders only"
    return ""


def _is_too_wide(found: SelectionStep, findings: Findings) -> str:
    # A bump as wide as that fits any smooth curve.
    winner, effect = found.winner, found.winner.candidate.effect
    if effect is None:
        return ""
    range_seen = max(float(np.ptp(b.measured.angle)) for b in findings.balances)
    widths = [float(winner.fit.whole[u.place]) for u in winner.unknowns if u.place in effect.widths]
    if any(width > _LOCAL * range_seen for width in widths):
        return "its width is a large part of the recorded range: it approximates another curve"
    return ""


def _is_inside_its_tolerance(found: SelectionStep, _: Findings) -> str:
    winner = found.winner
    moved = [abs(u.x_of(winner.fit.whole)) for u in winner.unknowns if u.name == winner.candidate.frees]
    return "is inside its tolerance, or just outside" if moved and max(moved) <= LEAST_BEYOND else ""


_CRITERIA: tuple[RejectionCriterion, ...] = (
    _repeats_an_earlier_cause,
    is_ambiguous_with_a_cause,
    is_collinear_with_base,
    _explains_too_little,
    is_one_of_several,
    is_third,
    _helps_no_balance,
    _harms_a_balance,
    _lacks_its_back_emf,
    fails_on_other_segments,
    is_not_late,
    has_impossible_sign,
    _is_on_bound_without_need,
    has_no_full_period,
    has_no_whole_order,
    _is_too_wide,
    _is_inside_its_tolerance,
)


def _judged(findings: Findings) -> NDArray[np.bool_]:
    return findings.samples >= LEAST_SAMPLES


def _brought_down(found: SelectionStep) -> NDArray[np.bool_]:
    """Return which groups (9) a winner brings from over their threshold to the noise."""
    # A group that does not reject alone has to come down to the noise floor.
    fraction = np.where(found.before_groups > REJECTING, _CONCENTRATED * found.before_groups, 0.0)
    down = np.minimum(np.maximum(fraction, _NEARLY_NOISE_FLOOR), THRESHOLD)
    return np.asarray((found.before_groups > THRESHOLD) & (found.after_groups < down))


def _untouched(findings: Findings) -> NDArray[np.bool_]:
    """Return which judged groups (9) no cause has changed.

    The residual there is not an accepted cause's error of shape.
    """
    found = _judged(findings)
    for each in findings.accepted:
        before, after = (np.maximum(groups - THRESHOLD, 0.0) for groups in (each.before_groups, each.after_groups))
        found = found & (after > UNTOUCHED * before) & (UNTOUCHED * after < before)
    return found


def _share_over_noise_floor(found: SelectionStep, findings: Findings) -> float:
    """Return the share that a winner explains of the excess over the noise floor."""
    samples = np.where(_judged(findings), findings.samples, 0)
    before, after = (float(samples @ np.maximum(g - 1.0, 0.0)) for g in (found.before_groups, found.after_groups))
    return 1.0 - after / max(before, 1e-12)


def _is_clear(found: SelectionStep) -> bool:
    """Tell whether every other candidate leaves much more than the winner."""
    return all(competitor.fit.cost > _LATER_CLEAR * found.winner.fit.cost for competitor in found.refined[1:])


def _is_on_bound(found: SelectionStep) -> bool:
    """Tell whether a strength of the winner is on its bound."""
    winner = found.winner
    effect = winner.candidate.effect
    if effect is None:
        return False
    strengths = {effect.indices[k] for k in effect.strengths}
    return any(u.is_on_edge(winner.fit.whole) for u in winner.unknowns if u.place in strengths)
