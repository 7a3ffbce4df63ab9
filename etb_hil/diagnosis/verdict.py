"""From numbers with intervals to a verdict with its reasons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from etb_hil.base.outcome import UnitVerdict
from etb_hil.diagnosis.exceedance import COULOMB, FAR_ABOVE, KINDS, Exceedance
from etb_hil.diagnosis.result import Number, Reason

MOST_LOST = 0.05  # share of the samples
_LONGEST_EXCEEDANCE_NS = 20_000_000  # of all episodes together, beyond which they decide alone

_NAMES = {"T_st": "stiction torque T_st", "T_c": "Coulomb torque T_c", "return_margin": "return margin"}


@dataclass(frozen=True, slots=True)
class Grounds:
    """What a verdict is made from, beside the numbers."""

    exceedances: Sequence[Exceedance]
    moved: float  # rad, from the lowest to the highest angle
    fastest: float  # rad/s
    stribeck_velocity: float  # rad/s, by the model
    lost: int
    samples: int
    current_verified: bool
    highest_current: float  # A
    more_viscous: float  # N·m·s/rad, fitted less the model's; 0 where nothing was fitted


def stand(
    value: float, low: float, high: float, limit_low: float | None, limit_high: float | None, band: float
) -> UnitVerdict:
    """Hold a value's interval against its limits; `band` is a share of the limit, inside which nothing is decided."""
    verdicts = []
    if limit_high is not None:
        margin = band * abs(limit_high)
        verdicts.append(_side(limit_high - high - margin, low - limit_high - margin))
    if limit_low is not None:
        margin = band * abs(limit_low)
        verdicts.append(_side(low - limit_low - margin, limit_low - high - margin))
    if not low <= value <= high:
        return UnitVerdict.INCONCLUSIVE
    for worst in (UnitVerdict.FAIL, UnitVerdict.INCONCLUSIVE):
        if worst in verdicts:
            return worst
    return UnitVerdict.PASS


def _side(inside: float, outside: float) -> UnitVerdict:
    if outside > 0.0:
        return UnitVerdict.FAIL
    return UnitVerdict.PASS if inside > 0.0 else UnitVerdict.INCONCLUSIVE


def conclude(numbers: Sequence[Number], grounds: Grounds) -> tuple[UnitVerdict, tuple[Reason, ...]]:
    """Return the verdict with its reasons, the deciding one first: fail outranks inconclusive, inconclusive pass."""
    judged = [number for number in numbers if number.verdict is not None]
    missing = [name for name in _NAMES if all(number.id != name for number in judged)]
    fails = [*_limits_broken(judged), *_exceedances_alone(judged, grounds)]
    doubts = [*_poor_evidence(grounds, missing), *_undecided(judged, grounds)]
    if grounds.lost > MOST_LOST * (grounds.samples + grounds.lost):
        share = grounds.lost / (grounds.samples + grounds.lost)
        lost = Reason(
            "samples_lost",
            f"{share:.1%} of the samples are lost, more than {MOST_LOST:.0%}",
            "look at the bus load and at the frames lost per message, then repeat",
        )
        return UnitVerdict.INCONCLUSIVE, (lost, *fails, *doubts)
    if fails:
        return UnitVerdict.FAIL, (*fails, *doubts)
    if doubts:
        return UnitVerdict.INCONCLUSIVE, tuple(doubts)
    words = "; ".join(_sentence(number) for number in judged)
    return UnitVerdict.PASS, (Reason("within_limits", words, "none"),)


def _limits_broken(judged: Sequence[Number]) -> list[Reason]:
    reasons = []
    for number in judged:
        if number.verdict is UnitVerdict.FAIL:
            text = _sentence(number)
            if number.id == "return_margin" and number.value is not None and number.value <= 0.0:
                text += "; friction holds the plate against its springs"
            reasons.append(
                Reason(f"{number.id}_beyond_limit", text, "reject the unit; see where friction rises in the plots")
            )
    return reasons


def _exceedances_alone(judged: Sequence[Number], grounds: Grounds) -> list[Reason]:
    """Return reasons from episodes whose limit no fitted number has been found to break."""
    reasons = []
    for kind in KINDS:
        episodes = [e for e in grounds.exceedances if e.kind == kind and _stands(e, grounds.more_viscous)]
        lasted = sum(e.end_ns - e.start_ns for e in episodes)
        broken = any(n.id == kind and n.verdict is UnitVerdict.FAIL for n in judged)
        if broken or lasted < _LONGEST_EXCEEDANCE_NS:
            continue
        worst = max(episodes, key=lambda e: e.peak - e.allowance)
        known = any(n.id == kind for n in judged)
        if not known and not grounds.current_verified:
            continue
        what = "locally " if known else ""
        text = (
            f"friction is {what}above the limit of {kind} for {lasted * 1e-9:.3f} s, up to {worst.peak:.3f} N·m "
            f"(model uncertain by {worst.allowance:.3f}; allowed up to {worst.limit:.3f}) at {worst.angle:.3f} rad"
        )
        if not known:
            text += f"; the plate moved by {grounds.moved:.4f} rad at up to {grounds.highest_current:.2f} A"
        reasons.append(Reason(f"{kind}_exceeded", text, "reject the unit; see the exceedances for their places"))
    return reasons


def _stands(episode: Exceedance, more_viscous: float) -> bool:
    """Whether an episode still stands out once the viscous torque taken off is the fitted one and not the model's."""
    if episode.kind != KINDS[COULOMB]:
        return True
    return episode.peak - episode.allowance - more_viscous * abs(episode.velocity) > episode.limit


def _poor_evidence(grounds: Grounds, missing: Sequence[str]) -> list[Reason]:
    if not missing:
        return []
    if not grounds.samples:
        return [
            Reason("no_samples", "no phase with motion delivered current and angle", "check the measurement request")
        ]
    names = ", ".join(missing)
    current = "" if grounds.current_verified else " and the current's zero was never measured with the bridge off"
    return [
        Reason(
            "too_little_motion",
            f"no friction curve could be fitted for {names}: the plate moved by {grounds.moved:.4f} rad at up to "
            f"{grounds.highest_current:.2f} A{current}",
            "run a scenario with a current zero, ramps and dashes; check that the drive is enabled",
        )
    ]


def _undecided(judged: Sequence[Number], grounds: Grounds) -> list[Reason]:
    reasons = []
    for number in judged:
        if number.verdict is not UnitVerdict.INCONCLUSIVE:
            continue
        text = _sentence(number)
        step = "repeat the check, more often or slower, to narrow the interval"
        far = FAR_ABOVE * grounds.stribeck_velocity
        if number.id == "T_c" and grounds.fastest < far:
            text += f"; the plate never passed 2.15 omega_s ({grounds.fastest:.1f} of {far:.1f} rad/s)"
            step = "add a dash that passes 2.15 omega_s"
        reasons.append(Reason(f"{number.id}_undecided", text, step))
    return reasons


def _sentence(number: Number) -> str:
    allowed = []
    if number.limit_low is not None:
        allowed.append(f"at least {number.limit_low:.3f}")
    if number.limit_high is not None:
        allowed.append(f"at most {number.limit_high:.3f}")
    return (
        f"{_NAMES[number.id]} is {number.value:.3f} {number.unit} ({number.low:.3f} to {number.high:.3f}), "
        f"allowed {' and '.join(allowed)}"
    )
