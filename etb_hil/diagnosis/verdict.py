"""From numbers with intervals to a verdict with its reasons."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from etb_hil.base.outcome import UnitVerdict
from etb_hil.base.roles import ROLES
from etb_hil.diagnosis.grounds import Coverage, Grounds, longest_by_kind
from etb_hil.diagnosis.measurement_kind import FailedEstimate
from etb_hil.diagnosis.measuring import Measured
from etb_hil.diagnosis.places_seen import MOST_UNSEEN
from etb_hil.diagnosis.result import Reason
from etb_hil.results import shown

if TYPE_CHECKING:
    from etb_hil.diagnosis.measurement_kind import MeasurementKind

MOST_LOST = 0.05  # share of the samples, as `plausibility.MISSING`
LONGEST_GAP = 0.1  # s: longer than a dash
_LONGEST = 0.02  # s, of all unexplained episodes together: longer than a window of the fit
_STUCK = 0.2  # rad: a plate that moved by less was hardly moved
_WHOLE = 0.9  # of the ticks without a gap before them: with more, it was not for want of samples


def conclude(measured: Sequence[Measured], grounds: Grounds) -> tuple[UnitVerdict, tuple[Reason, ...]]:
    """Return the verdict with its reasons, the deciding one first.

    What withholds a verdict outranks fail, fail inconclusive, inconclusive pass; but where the data contradict the
    model, what is measured without the model still fails a unit. What a limit applies to has to be
    measured for a pass, where the run has the phases for it; limits that need other phases are said to be not judged.
    """
    judged = [one for one in measured if one.measurement.is_judged]
    missing = _missing(measured, grounds)
    without_signal = [
        _without_signal(name, kind, grounds) for name, kind in missing.items() if not kind.roles <= grounds.roles
    ]
    missing = {name: kind for name, kind in missing.items() if kind.roles <= grounds.roles}
    no_curve = [name for name, kind in missing.items() if not kind.phases and not grounds.has_curve]
    notes = {one.measurement.id: _why_not(one) for one in measured}
    withholding = [*_lost(grounds.coverage), *grounds.withholding]
    broken = _limits_broken(judged)
    fails = [*broken, *_at_one_place(judged, grounds, is_certain=True), *_stuck(grounds, no_curve)]
    doubts = [
        *without_signal,
        *_poor_evidence(grounds, no_curve),
        *(_not_measured(name, kind, notes.get(name)) for name, kind in missing.items() if name not in no_curve),
        *_not_seen(grounds),
        *_undecided(judged, grounds),
        *_at_one_place(judged, grounds, is_certain=False),
        *_by_direction_undecided(judged, grounds),
        *([] if grounds.pushed is None else [grounds.pushed]),
    ]
    if not broken:
        doubts += _unexplained(grounds)
    doubts += _gaps(grounds)
    remarks = (*grounds.remarks, *_not_judged(grounds))
    without_model = _limits_broken([one for one in judged if one.kind.is_model_free])
    if without_model and not _lost(grounds.coverage) and grounds.withholding:
        return UnitVerdict.FAIL, (*without_model, *grounds.withholding, *without_signal, *remarks)
    if grounds.withholding:  # friction by another model is no reason
        return UnitVerdict.INCONCLUSIVE, (*withholding, *without_signal, *remarks)
    if withholding:
        return UnitVerdict.INCONCLUSIVE, (*withholding, *fails, *doubts, *remarks)
    if fails:
        return UnitVerdict.FAIL, (*fails, *doubts, *remarks)
    if doubts or not judged:
        return UnitVerdict.INCONCLUSIVE, (*doubts, *remarks)
    words = "; ".join(shown.sentence(one.measurement) for one in judged)
    if not math.isnan(grounds.seen[0]):
        words += f"; seen from {_degrees(grounds.seen[0])} to {_degrees(grounds.seen[1])}, and of no other place"
    return UnitVerdict.PASS, (Reason("within_limits", words), *remarks)


def _missing(measured: Sequence[Measured], grounds: Grounds) -> dict[str, MeasurementKind]:
    """Return what a limit applies to and has no value, by its id.

    Of several values each counts: what others of them are says nothing of one that the run could not measure.
    """
    told = {name for one in measured for name in (one.kind.id, one.measurement.id)}
    without = {one.measurement.id: one.kind for one in measured if not one.measurement.is_known and one.is_limited}
    missing = {name: kind for name, kind in grounds.limited.items() if name not in told} | without
    return {name: kind for name, kind in missing.items() if not kind.phases or kind.phases & grounds.phases}


def _degrees(angle: float) -> str:
    return shown.quantity(angle, "rad", 1)


def _without_signal(name: str, kind: MeasurementKind, grounds: Grounds) -> Reason:
    names = ", ".join(f"{role} ({ROLES[role].meaning})" for role in sorted(kind.roles - grounds.roles))
    return Reason(
        f"{name}_without_signal",
        f"{_named(name, kind)} was not measured: the run has no samples of {names}",
    )


def _named(name: str, kind: MeasurementKind) -> str:
    return kind.name_of(name.removeprefix(kind.id))


def _why_not(one: Measured) -> str:
    """Return the note of a measurement; the error of a plug-in is for its engineer."""
    return "its plug-in failed" if isinstance(one.estimate, FailedEstimate) else one.measurement.note


def _not_measured(name: str, kind: MeasurementKind, note: str | None) -> Reason:
    text = f"{_named(name, kind)} was not measured: {note or 'the motion of this run does not show it'}"
    if kind.phases and not note:
        phases = ", ".join(sorted(kind.phases))
        text = f"{_named(name, kind)} was not measured, although the run has a phase for it ({phases})"
    return Reason(f"{name}_not_measured", text)


def _not_judged(grounds: Grounds) -> list[Reason]:
    """Return a remark on limits whose measurements this scenario has no phase for."""
    unseen = {k.id: k for k in grounds.limited.values() if k.phases and not k.phases & grounds.phases}
    if not unseen:
        return []
    names = ", ".join(f"{kind.name} ({' or '.join(sorted(kind.phases))})" for kind in unseen.values())
    return [Reason("limits_not_judged", f"limits that this run has no phase for: {names}")]


def _lost(coverage: Coverage) -> list[Reason]:
    if coverage.lost <= MOST_LOST * (coverage.samples + coverage.lost):
        return []
    share = coverage.lost / (coverage.samples + coverage.lost)
    text = f"{share:.1%} of the samples are lost, more than {MOST_LOST:.0%}"
    return [Reason("samples_lost", text)]


def _limits_broken(judged: Sequence[Measured]) -> list[Reason]:
    return [
        Reason(
            f"{one.measurement.id}_beyond_limit",
            shown.sentence(one.measurement) + one.estimate.if_failed,
        )
        for one in judged
        if one.measurement.verdict is UnitVerdict.FAIL
    ]


def _at_one_place(judged: Sequence[Measured], grounds: Grounds, *, is_certain: bool) -> list[Reason]:
    """Return the reasons of friction or return margin beyond a limit at one place.

    They are beyond it or, where the place is not certain, may be. There is none where the fitted curve itself is
    beyond it and, where the place is not certain, none unless the curve keeps the limit.
    """

    def speaks(name: str) -> bool:
        verdict = stands(judged, name)
        return verdict is not UnitVerdict.FAIL if is_certain else verdict is UnitVerdict.PASS

    found, excess, short = [], grounds.excess, grounds.shortfall
    if excess is not None and excess.is_certain is is_certain and speaks("T_st"):
        interval = f"at least {excess.low:.3f}" if is_certain else f"{excess.low:.3f} to {excess.high:.3f}"
        text = (
            f"friction is locally {excess.torque:.3f} N·m at {math.degrees(excess.angle):.1f} deg, in "
            f"{'one direction' if excess.is_one_way else 'both directions'} of motion "
            f"({interval}; allowed up to {excess.limit:.3f})"
        )
        found.append(Reason("T_st_exceeded" if is_certain else "T_st_local_undecided", text))
    if short is not None and short.is_certain is is_certain and speaks("return_margin"):
        interval = f"at most {short.high:.3f}" if is_certain else f"{short.low:.3f} to {short.high:.3f}"
        text = (
            f"at {math.degrees(short.angle):.1f} deg friction is locally higher and the return margin is "
            f"{short.margin:.3f} N·m ({interval}; at least {short.limit:.3f} needed)"
        )
        found.append(Reason("return_margin_local" if is_certain else "return_margin_local_undecided", text))
    return found


def _by_direction_undecided(judged: Sequence[Measured], grounds: Grounds) -> list[Reason]:
    """Return the reason that friction may be above a limit in one direction.

    Friction then differs by direction, and its mean keeps the limit.
    """
    more = abs(grounds.by_direction)
    names = []
    for one in judged:
        found = one.measurement
        if one.kind.is_friction and found.verdict is UnitVerdict.PASS:
            most = (found.limit_high or math.inf) * (1.0 - grounds.band)
            if more > 0.0 and (found.high or 0.0) + more > most:
                names.append(found.id)
    if not names:
        return []
    way = "opening" if grounds.by_direction > 0.0 else "closing"
    text = (
        f"both springs differ from each other beyond the model's tolerance; or friction is up to {more:.3f} N·m "
        f"higher {way} the plate than the mean of both directions: then {' and '.join(names)} may be above the limit"
    )
    return [Reason("direction_undecided", text)]


def stands(judged: Sequence[Measured], name: str) -> UnitVerdict | None:
    """Return the verdict on a measurement, None where it is not judged."""
    return next((one.measurement.verdict for one in judged if one.measurement.id == name), None)


def _stuck(grounds: Grounds, missing: Sequence[str]) -> list[Reason]:
    """Return a reason where the plate did not move under a high torque.

    The torque was far above the limit, in a current that is certain.
    """
    if not missing or grounds.moved > _STUCK or not (grounds.current_verified and grounds.current_plausible):
        return []
    lasted, worst = longest_by_kind(grounds.unexplained).get("T_st", (0.0, None))
    if worst is None or lasted < _LONGEST or worst.peak - worst.allowance <= worst.limit * (1.0 + grounds.band):
        return []
    text = (
        f"the plate moved by {math.degrees(grounds.moved):.2f} deg while the motor pushed at up to "
        f"{grounds.highest_current:.2f} A: "
        f"friction holds it against {worst.peak:.3f} N·m (model uncertain by {worst.allowance:.3f}; allowed up to "
        f"{worst.limit:.3f})"
    )
    return [Reason("plate_stuck", text)]


def _unexplained(grounds: Grounds) -> list[Reason]:
    """Return the reason that live friction was above a limit for long, if it was.

    Nothing that was fitted explains it.
    """
    reasons = []
    for kind, (lasted, worst) in longest_by_kind(grounds.unexplained).items():
        if lasted < _LONGEST:
            continue
        text = (
            f"friction seemed above the limit of {kind} for {lasted:.3f} s, up to {worst.peak:.3f} N·m (model "
            f"uncertain by {worst.allowance:.3f}; allowed up to {worst.limit:.3f}) at "
            f"{math.degrees(worst.angle):.1f} deg, and the "
            "fitted curve does not explain it"
        )
        reasons.append(Reason(f"{kind}_unexplained", text))
    return reasons


def _gaps(grounds: Grounds) -> list[Reason]:
    reasons = []
    coverage = grounds.coverage
    if coverage.longest_gap > LONGEST_GAP:
        text = f"no samples for {coverage.longest_gap:.2f} s in or next to a {coverage.gap_in}: at most {LONGEST_GAP} s"
        reasons.append(Reason("samples_missing", text))
    if not grounds.complete:
        reasons.append(Reason("run_not_finished", "the run ended before its last phase"))
    return reasons


def _poor_evidence(grounds: Grounds, missing: Sequence[str]) -> list[Reason]:
    if not missing:
        return []
    if not grounds.coverage.samples:
        return [Reason("no_samples", "no phase with motion delivered current and angle")]
    names = ", ".join(missing)
    current = "" if grounds.current_verified else " and the current's zero was never measured with the bridge off"
    if grounds.moved > _STUCK and grounds.follows < _WHOLE:
        return [
            Reason(
                "too_few_windows",
                f"no friction curve could be fitted for {names}: {sum(grounds.windows)} segments of at least 17 ms in "
                f"steady motion have samples in every millisecond, of {grounds.coverage.samples} samples in "
                f"all{current}",
            )
        ]
    return [
        Reason(
            "too_little_motion",
            f"no friction curve could be fitted for {names}: the plate moved by "
            f"{math.degrees(grounds.moved):.2f} deg at up to "
            f"{grounds.highest_current:.2f} A, {sum(grounds.windows)} segments of at least 17 ms in all{current}",
        )
    ]


def _not_seen(grounds: Grounds) -> list[Reason]:
    """Return the reason that a wide segment of the way was not slid over slowly.

    T_st may be different there.
    """
    unseen = grounds.unseen
    if unseen is None:
        return []
    text = (
        f"from {math.degrees(unseen.start):.1f} to {math.degrees(unseen.end):.1f} deg, {unseen.share:.0%} of "
        "its way, the plate did not slide "
        f"slowly in both directions; at most {MOST_UNSEEN:.0%} in one segment may stay unseen"
    )
    if unseen.stop is not None:
        text += f"; it passed the model's stop at {_degrees(unseen.stop)}, beyond which nothing is judged"
    return [Reason("places_not_seen", text)]


def _undecided(judged: Sequence[Measured], grounds: Grounds) -> list[Reason]:
    reasons = []
    for one in judged:
        if one.measurement.verdict is not UnitVerdict.INCONCLUSIVE:
            continue
        if grounds.unseen is not None and not one.estimate.may_pass and one.estimate.undecided is None:
            continue  # the way that was not seen is a doubt by itself, and repeating narrows no interval of it
        if one.measurement.interval is None:
            text = f"{shown.sentence(one.measurement)}; without an interval it is held against no limit"
            reasons.append(Reason(f"{one.measurement.id}_without_interval", text))
            continue
        usual = Reason(f"{one.measurement.id}_undecided", shown.sentence(one.measurement))
        reasons.append(one.estimate.undecided or usual)
    return list(dict.fromkeys(reasons))
