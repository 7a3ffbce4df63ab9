"""Detection limits: the smallest strengths of effects that a search accepts.

Base parameters mask an effect as far as their tolerances let them: from some size on it is detectable. The limit is
given the model with all causes; for a cause, and what is ambiguous with it, given the model without it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.candidates.candidate import beyond_judging, own_name
from etb_hil.discrepancy.measured.filter_record import as_record
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.estimation.climbing import Fitted
from etb_hil.estimation.record import Record, joined
from etb_hil.estimation.unknown import Unknown
from etb_hil.hypotheses.candidates import Candidate, candidates
from etb_hil.hypotheses.constants import PARAMETER
from etb_hil.hypotheses.information import information_of
from etb_hil.hypotheses.informative_part import informative_part
from etb_hil.hypotheses.prepared import Prepared, prepared
from etb_hil.plant.drive_effects import unit_for
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.effect import Effect
from etb_hil.results.explained.residual import DetectionLimit

Sizes = tuple[float | None, float | None]


def detection_limits(findings: Findings) -> dict[str, DetectionLimit]:
    """Return by effect the smallest strength that would be accepted as a cause.

    It is the larger one of both signs. Above the effect's bounds it is not `within_bounds`; an effect that was not
    tested is not `judged`: there is no limit, and `text` gives the reason. The limit of an effect of a place holds in
    the `valid_range` of the motion. What is no cause has a shape in the middle of those that are tried.
    """
    if not findings.tested:
        return {}
    whole = joined([as_record(b.measured, findings.model) for b in findings.balances])
    made = prepared(
        findings.found.record if findings.found else informative_part(whole, findings.model), findings.model
    )
    record, fit = (findings.found.record, findings.found.final) if findings.found else made.calibrated()
    together: dict[tuple[int, ...], list[Candidate]] = defaultdict(list)
    for id_ in CATALOGUE:
        if id_ in findings.tested and (shapes := _shapes(record, fit, made, id_)):
            # The accepted causes that the effect is, or is not isolable from.
            known_as = tuple(
                k for k, each in enumerate(findings.accepted) if id_ in (each.winner.id, *each.ambiguity_group)
            )
            together[known_as].append(shapes[0] if known_as else shapes[len(shapes) // 2])
    limits: dict[str, DetectionLimit] = {}
    for known_as, asked in together.items():
        causes = [findings.accepted[k] for k in known_as]
        found = information_of(record, fit.parameters, _unknowns_without(fit, made, causes), asked)
        for k, candidate in enumerate(asked):
            strength = candidate.unknowns()[0]
            up = found.smallest(k, strength.high)
            sizes = (up, found.smallest(k, strength.low) if strength.low < 0.0 else up)
            limits[candidate.id] = _judged(findings, candidate, sizes, causes)
    return {id_: limits[id_] if id_ in limits else _not_judged(findings, effect) for id_, effect in CATALOGUE.items()}


def _shapes(record: Record, fit: Fitted, made: Prepared, id_: str) -> list[Candidate]:
    """Return the shapes of an effect that a record shows, that of the fit first."""
    if id_ not in made.effects:
        return []
    effect = made.effects[id_]
    is_fitted = any(one.effect is not None and one.effect.id == id_ for one in fit.unknowns)
    own = [Candidate(effect, fit.parameters)] if is_fitted else []
    return [*own, *candidates(record, fit.parameters, [effect])]


def _unknowns_without(fit: Fitted, made: Prepared, causes: Sequence[SelectionStep]) -> list[Unknown]:
    """Return the unknowns of a fit without some causes.

    A parameter that was a cause has its tolerance again.
    """
    ids = {own_name(each.winner.id) for each in causes}
    stated = {PARAMETER + one.name: one for one in made.unknowns}
    kept = [one for one in fit.unknowns if one.effect is None or one.effect.id not in ids]
    return [stated[PARAMETER + one.name] if PARAMETER + one.name in ids else one for one in kept]


def _judged(findings: Findings, candidate: Candidate, sizes: Sizes, causes: Sequence[SelectionStep]) -> DetectionLimit:
    effect, strength = CATALOGUE[candidate.id], candidate.unknowns()[0]
    parameter = effect.parameters[effect.searched[0]]
    unit = unit_for(parameter, is_linear=findings.is_linear)
    seen = [size for size in sizes if size is not None]
    if causes:
        says = _found(candidate.id, causes)
    elif not seen:
        says = f"not detectable in these data: {_most(strength.high, unit)}"
    elif len(seen) < len(sizes):
        says = f"detectable with one sign only: {_most(strength.high if sizes[0] is None else strength.low, unit)}"
    else:
        says = ""
    limit = max(seen, default=None)
    where = where_it_went(findings) if effect.is_of_place and limit is not None else ""
    says = "; ".join(filter(None, [says, f"valid for the recorded range: {where}" if where else ""]))
    is_within = bool(seen or causes)
    return DetectionLimit(
        parameter.name, limit, unit, judged=True, within_bounds=is_within, text=says, valid_range=where
    )


def where_it_went(findings: Findings) -> str:
    """Return the range of motion in the judged samples."""
    ways = [b.measured.angle[b.measured.is_good] for b in findings.balances]
    low, high = min(float(way.min()) for way in ways), max(float(way.max()) for way in ways)
    if findings.is_linear:
        return f"{low:.3g} to {high:.3g} m"
    return f"{np.degrees(low):.1f} to {np.degrees(high):.1f} deg"


def _not_judged(findings: Findings, effect: Effect) -> DetectionLimit:
    """Return the entry of an effect that was not tested, with the reason."""
    if any(one.is_of_effect and one.id == effect.id for one in findings.model.measured.values()):
        says = "measured at the bench"
    elif any(entry.id == effect.id for entry in findings.model.effects):
        says = "part of the model file"
    elif effect.id in findings.tested:
        says = "the motion is too short for its shape"
    else:
        says = beyond_judging(findings.balances).get(effect.id, "not tested")
    parameter = effect.parameters[effect.searched[0]]
    unit = unit_for(parameter, is_linear=findings.is_linear)
    return DetectionLimit(parameter.name, None, unit, judged=False, within_bounds=False, text=says)


def _most(most: float, unit: str) -> str:
    its = "" if unit == "1" else f" {unit}"
    return f"base parameters inside their tolerances mask even its bound of {most:.3g}{its}"


def _found(id_: str, causes: Sequence[SelectionStep]) -> str:
    """Say that an effect is a cause, or not isolable from one."""
    names = [each.winner.id for each in causes]
    return "a cause" if id_ in names else f"not isolable from the cause {', '.join(names)}"
