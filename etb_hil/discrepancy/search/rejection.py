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
_LATER_GAIN = 0.25  # of the squared residual that earlier causes left
_LATER_T = 4.0  # over the held-out segments
_LATER_CERTAIN = 0.8  # of the residual: what takes as much is a cause, whatever else might take it
_LATER_CLEAR = 1.5  # times what it leaves: no other candidate may leave less where base parameters do nearly the same
_LATER_MOST = 0.5  # of what is over the noise floor: a later cause that takes less has to be clear
_LATER_PARAMETER = 0.5  # a parameter that leaves its tolerance after an effect may be no more than the effect's shape
# What chance brings down, of a group's noise floor: torque, voltage, angle; each on a stop, slow, sliding.
GROUP_GAIN = np.array([4.0, 1.0, 0.25, 1.2, 0.12, 0.35, 0.4, 0.12, 0.2])
# Share that a cause may raise a group by; the torque balance is left out: its groups share one friction.
_GROUP_LOSS = np.array([np.inf, np.inf, np.inf, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2])
_VOLTAGE = slice(3, 6)
_CERTAIN_GAIN = 0.5
_CONCENTRATED = 0.33
_NEARLY_NOISE_FLOOR = 1.2
_LEAST_T = 1.5  # over the held-out segments
_LATE = 0.2  # of the larger of a delay and a lag: true ones are late by 0.6 of it and more together
_LOCAL = 0.25  # of the range of the motion: what is wider at half its height, on either side, is not at one place
_WHOLE = 0.1  # of a wave a motor turn; true ones are found within 0.004


def reason_to_reject(found: SelectionStep, findings: Findings) -> str:
    """Return the first reason why a step's winner is no cause, empty if it is one."""
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
    # A true cause leaves no balance worse than it was: magnets that weaken show in the back-EMF, too, and a torque that
    # they might explain is not theirs where the voltage has to be bent for it.
    is_harmed = after - before > _GROUP_LOSS * np.maximum(before, 1.0)
    return bool((is_harmed & _judged(findings)).any())


def _repeats_an_earlier_cause(found: SelectionStep, findings: Findings) -> str:
    if not findings.accepted:
        return ""
    explains_all = explains_nearly_all(found, findings)
    if not explains_all and _is_on_bound(found):
        return "its strength is on a bound: it stands for something else"
    if not explains_all and found.winner.id in siblings(findings.accepted):
        return "looks like a cause that was found before, whose shape may be the residual"
    return ""


def is_ambiguous_with_a_cause(found: SelectionStep, findings: Findings) -> str:
    """Reject a winner that is in one ambiguity group with an earlier cause."""
    if any(r.winner.id in found.ambiguity_group or found.winner.id in r.ambiguity_group for r in findings.accepted):
        return "cannot be told from a cause that was found before"
    return ""


def is_collinear_with_base(found: SelectionStep, findings: Findings) -> str:
    """Reject a later cause collinear with base parameters, unless it explains most."""
    # What base parameters are collinear with but for a fifth, several candidates do: only one that beats them all is
    # the one.
    if not findings.accepted or explains_nearly_all(found, findings) or _is_clear(found):
        return ""
    if any(name.startswith("parameter:") for name in found.ambiguity_group):
        return "base parameters explain nearly as much, and so do other candidates"
    return ""


def _explains_too_little(found: SelectionStep, findings: Findings) -> str:
    least = LEAST_GAIN + _HEALTHY_TIMES * found.healthy_gain
    if findings.accepted:
        # After one cause, what another takes may be no more than that the first one's shape is not quite ours.
        is_its_own = found.t >= _LATER_T or (_brought_down(found) & _untouched(findings)).any()
        least = max(least, 2.0 * LEAST_GAIN if is_its_own else _LATER_GAIN)
        if found.winner.candidate.frees:
            least = max(least, _LATER_PARAMETER)
    if found.gain > least:
        return ""
    return f"takes {100.0 * found.gain:.1f} % of the residual; a cause explains {100.0 * least:.1f} %"


def is_one_of_several(found: SelectionStep, findings: Findings) -> str:
    """Reject a later cause that explains a minor part, as others nearly do."""
    # Of what one unknown effect does each unmodelled effect bends a part to itself, and the next one the rest:
    # together they do all of it. A cause that is there takes most of the residual, or nobody else does as well.
    if not findings.accepted or _share_over_noise_floor(found, findings) > _LATER_MOST or _is_clear(found):
        return ""
    return "explains less than half of the residual, and other candidates explain nearly as much"


def is_third(found: SelectionStep, findings: Findings) -> str:
    """Reject a third cause that is not significant in cross-validation."""
    # What two causes leave whose shapes are not quite ours is small beside what they took, and some third bends to it.
    if len(findings.accepted) < 2 or found.t > _LATER_T:
        return ""
    return f"two causes may leave as much; a third holds on segments that the fit did not see: t is {found.t:.1f}"


def _helps_no_balance(found: SelectionStep, findings: Findings) -> str:
    is_helped = found.before_groups - found.after_groups > GROUP_GAIN
    return "" if (is_helped & _judged(findings)).any() else "brings no balance down by more than chance does"


def _harms_a_balance(found: SelectionStep, findings: Findings) -> str:
    is_harmed = harms(found.before_groups, found.after_groups, findings)
    return "another balance contradicts it: it is worse off with it" if is_harmed else ""


def _lacks_its_back_emf(found: SelectionStep, findings: Findings) -> str:
    # Torque constant and back-EMF are one number: where magnets weaken the voltage comes down, however little they do.
    effect = found.winner.candidate.effect
    if effect is None or not effect.is_of_one_motor_constant:
        return ""
    samples = np.where(_judged(findings), findings.samples, 0)[_VOLTAGE]
    before, after = samples @ found.before_groups[_VOLTAGE], samples @ found.after_groups[_VOLTAGE]
    return "the back-EMF does not change with it" if after > before else ""


def fails_on_other_segments(found: SelectionStep, findings: Findings) -> str:
    """Reject a winner whose gain does not hold in cross-validation."""
    # What sits in few segments scores low over all of them although it is certain: t guards small gains only, and none
    # that bring a group which was over its threshold down.
    if found.t > _LEAST_T or found.gain > _CERTAIN_GAIN or (_brought_down(found) & _judged(findings)).any():
        return ""
    return f"does not hold on segments that the fit did not see: t is {found.t:.1f}"


def is_not_late(found: SelectionStep, _: Findings) -> str:
    """Reject a delay and a lag that together make the current no later."""
    # No current comes before its cause: then the angles are late. And what filters all channels is nobody's delay.
    winner = found.winner
    effect = winner.candidate.effect
    if effect is None or not effect.acts_at(Port.CURRENT_LATENESS):
        return ""
    delay, lag = (float(winner.fit.whole[effect.indices[k]]) for k in effect.strengths)
    if delay + lag > _LATE * max(abs(delay), abs(lag)):
        return ""
    return "its delay and lag make the current no later: the angles may be late, or one filter is on all channels"


def has_impossible_sign(found: SelectionStep, _: Findings) -> str:
    """Reject a strength below zero that cannot be negative."""
    # A layer that pulls, a memory that gives back more than it took: the fit is bending something else.
    winner = found.winner
    effect = winner.candidate.effect
    if effect is None or not effect.is_one_way:
        return ""
    strengths = [winner.fit.whole[effect.indices[k]] for k in effect.strengths]
    return "its strength is below nothing, which it cannot be" if sum(strengths) < 0.0 else ""


def _is_on_bound_without_need(found: SelectionStep, findings: Findings) -> str:
    # Nothing calls for a cause, and this one would be as strong as can be: it fits what differs between devices.
    if _is_on_bound(found) and not rejects(found.before_groups, _judged(findings)):
        return "its strength is on a bound where nothing was over its threshold"
    return ""


def has_no_full_period(found: SelectionStep, _: Findings) -> str:
    """Reject a wave whose period is the longest allowed."""
    # A part of a wave is any curve.
    effect = found.winner.candidate.effect
    orders = [] if effect is None else [u for u in found.winner.unknowns if u.place in effect.orders]
    if any(u.x_of(found.winner.fit.whole) <= u.low + 1e-6 for u in orders):
        return "its period is longer than the range it was seen in: it stands for something else"
    return ""


def has_no_whole_order(found: SelectionStep, findings: Findings) -> str:
    """Reject a motor's wave that has no whole number of periods a turn."""
    # A motor's slots, poles and bars come a whole number of times a turn. A drive's turn is another's.
    winner, effect = found.winner, found.winner.candidate.effect
    if effect is None or findings.balances[0].measured.is_drive:
        return ""
    orders = [float(winner.fit.whole[u.place]) for u in winner.unknowns if u.place in effect.counts]
    if any(abs(order - round(order)) > _WHOLE for order in orders):
        return f"it comes {orders[0]:.3g} times a motor turn, which no slots do: it stands for something else"
    return ""


def _is_too_wide(found: SelectionStep, findings: Findings) -> str:
    # So wide a bump is any curve, too.
    winner, effect = found.winner, found.winner.candidate.effect
    if effect is None:
        return ""
    range_seen = max(float(np.ptp(b.measured.angle)) for b in findings.balances)
    widths = [float(winner.fit.whole[u.place]) for u in winner.unknowns if u.place in effect.widths]
    if any(width > _LOCAL * range_seen for width in widths):
        return "its width is a good part of the range it was seen in: it stands for something else"
    return ""


def _is_inside_its_tolerance(found: SelectionStep, _: Findings) -> str:
    winner = found.winner
    moved = [abs(u.x_of(winner.fit.whole)) for u in winner.unknowns if u.name == winner.candidate.frees]
    return "inside its tolerance, or next to it" if moved and max(moved) <= LEAST_BEYOND else ""


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
    # What rejects nothing alone, to the noise floor.
    fraction = np.where(found.before_groups > REJECTING, _CONCENTRATED * found.before_groups, 0.0)
    down = np.minimum(np.maximum(fraction, _NEARLY_NOISE_FLOOR), THRESHOLD)
    return np.asarray((found.before_groups > THRESHOLD) & (found.after_groups < down))


def _untouched(findings: Findings) -> NDArray[np.bool_]:
    """Return which judged groups (9) no cause has changed.

    Nothing there is the residual of a cause.
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
