"""Detection limits: the smallest strength of each effect that these data show.

Base parameters mask an effect as far as their tolerances let them: from some size on it is detectable. The limit is
given the model with all causes; for a cause, and what is ambiguous with it, given the model without it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.side_by_side import side_by_side
from etb_hil.discrepancy.answer.masking import Masking
from etb_hil.discrepancy.candidates.candidate import Candidate, beyond_judging
from etb_hil.discrepancy.candidates.sensitivity import stepped
from etb_hil.discrepancy.fitting.calibration import residual_of
from etb_hil.discrepancy.fitting.noise_floor import LEAST_SAMPLES
from etb_hil.discrepancy.fitting.unknowns import Unknown, effect_unknowns
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.plant.drive_effects import unit_for
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.effect import Effect
from etb_hil.results.explained.residual import DetectionLimit

Float64 = NDArray[np.float64]

_SIGMAS = 3.0
LEAST_GAIN = 0.04  # of the squared residual, that an effect takes where it is detectable
# Reduction by chance, in units of a group's noise floor: torque, voltage, angle; each on a stop, slow, sliding.
_GROUP_GAIN = np.array([4.0, 1.0, 0.25, 1.2, 0.12, 0.35, 0.4, 0.12, 0.2])
_CORRELATED = 4.0  # samples of the threshold-limited, coloured residual that are one independent value


def detection_limits(findings: Findings, least_gain: float) -> dict[str, DetectionLimit]:
    """Return by effect the smallest detectable strength, with its unit.

    Detectable means by three sigma, by a cause's least share of the residual, and in one group by more than chance. It
    is the larger one of both signs. Above the effect's bounds it is not `within_bounds`; an effect that was not tested
    is not `judged`: there is no limit, and `says` gives the reason. The limit of an effect of a place holds `where` the
    record went, and `says` so. What is no cause has a shape in the middle of those that are tried.
    """
    if not findings.tested:
        return {}
    fit = findings.final.fit
    noise = float(np.sqrt(fit.cost / max(int(np.count_nonzero(fit.residual)), 1)))
    least = max(_SIGMAS**2 * noise**2 * _CORRELATED, least_gain * fit.cost)
    hidden = Masking(
        findings, least, np.where(findings.samples >= LEAST_SAMPLES, findings.samples * _GROUP_GAIN, np.inf)
    )
    asked = {id_: shapes[len(shapes) // 2] for id_, shapes in findings.tested.items()}
    asked |= {each.winner.id: each.winner.candidate for each in findings.accepted}
    judged = [asked[id_] for id_ in CATALOGUE if id_ in asked]
    found = side_by_side(lambda one: _judged(findings, one, hidden), judged)
    limits = dict(zip((one.id for one in judged), found, strict=True))
    return {id_: limits[id_] if id_ in limits else _not_judged(findings, effect) for id_, effect in CATALOGUE.items()}


def _judged(findings: Findings, candidate: Candidate, hidden: Masking) -> DetectionLimit:
    effect = candidate.effect
    assert effect is not None  # noqa: S101 (asked of effects alone)
    unknown = _strength(findings, effect)
    known_as = [each for each in findings.accepted if candidate.id in (each.winner.id, *each.ambiguity_group)]
    masked = hidden.by(_column(findings, candidate, unknown), known_as)
    up = masked.smallest(unknown.high, 1.0)
    low = 0.0 if effect.is_one_way else unknown.low
    down = masked.smallest(-low, -1.0) if low < 0.0 else up
    sizes = [one * unknown.scale for one in (up, down) if one is not None]
    unit = unit_for(effect.parameters[effect.searched[0]], is_linear=_is_linear(findings))
    if known_as:
        says = _found(candidate.id, known_as)
    elif not sizes:
        says = f"not detectable in these data: {_most(unknown.high * unknown.scale, unit)}"
    elif up is None or down is None:
        says = f"detectable with one sign only: {_most((unknown.high if up is None else low) * unknown.scale, unit)}"
    else:
        says = ""
    limit = max(sizes, default=None)
    where = where_it_went(findings) if effect.is_of_place and limit is not None else ""
    says = "; ".join(filter(None, [says, f"valid for the recorded range: {where}" if where else ""]))
    return replace(_entry(findings, effect, limit, says, is_within=bool(sizes or known_as)), valid_range=where)


def where_it_went(findings: Findings) -> str:
    """Return the range of motion in the judged samples."""
    ways = [b.measured.angle[b.measured.is_good] for b in findings.balances]
    low, high = min(float(way.min()) for way in ways), max(float(way.max()) for way in ways)
    if _is_linear(findings):
        return f"{low:.3g} to {high:.3g} m"
    return f"{np.degrees(low):.1f} to {np.degrees(high):.1f} deg"


def _not_judged(findings: Findings, effect: Effect) -> DetectionLimit:
    """Return the entry of an effect that was not tested, with the reason."""
    if any(one.is_of_effect and one.id == effect.id for one in findings.model.measured.values()):
        says = "measured at the bench"
    elif any(entry.id == effect.id for entry in findings.model.effects):
        says = "part of the model file"
    else:
        says = beyond_judging(findings.balances).get(effect.id, "not tested")
    return _entry(findings, effect, None, says, is_within=False, is_judged=False)


def _entry(
    findings: Findings, effect: Effect, limit: float | None, says: str, *, is_within: bool, is_judged: bool = True
) -> DetectionLimit:
    parameter = effect.parameters[effect.searched[0]]
    unit = unit_for(parameter, is_linear=_is_linear(findings))
    return DetectionLimit(parameter.name, limit, unit, judged=is_judged, within_bounds=is_within, text=says)


def _is_linear(findings: Findings) -> bool:
    return findings.balances[0].measured.is_linear


def _most(most: float, unit: str) -> str:
    its = "" if unit == "1" else f" {unit}"
    return f"base parameters inside their tolerances mask even its bound of {most:.3g}{its}"


def _found(id_: str, known_as: Sequence[SelectionStep]) -> str:
    """Say that an effect is a cause, or not isolable from one."""
    names = [each.winner.id for each in known_as]
    return "a cause" if id_ in names else f"not isolable from the cause {', '.join(names)}"


def _strength(findings: Findings, effect: Effect) -> Unknown:
    """Return the first searched strength, scaled by its step, within its bounds."""
    return effect_unknowns(effect, [0.0] * len(effect.parameters), findings.balances[0].load)[effect.searched[0]]


def _column(findings: Findings, candidate: Candidate, unknown: Unknown) -> Float64:
    """Return the sensitivity (n) of the residual to a scaled unit of a strength."""
    final = findings.final
    for k, one in enumerate(final.unknowns):
        if one.place == unknown.place:
            return np.asarray(final.jacobian[:, k] * (unknown.scale / one.scale))
    step, *_ = stepped(residual_of(findings.balances), final.fit, candidate).T
    return np.asarray(step * (unknown.scale / candidate.steps[0]))
