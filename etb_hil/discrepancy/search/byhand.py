"""Numbers that were measured at the bench: those that are off are causes, taken in before any is looked for."""

from __future__ import annotations

from etb_hil.discrepancy.fitting.calibration import calibrate, residual_of
from etb_hil.discrepancy.fitting.floor import group_means
from etb_hil.discrepancy.fitting.segments import held_out, segment_of
from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.findings import Findings, Round
from etb_hil.discrepancy.search.standing import take_in
from etb_hil.discrepancy.suspects.candidates import Candidate
from etb_hil.discrepancy.suspects.refining import Linearised, bent
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.parameters import Model
from etb_hil.results.explanation import BenchNumber


def measured(model: Model) -> tuple[BenchNumber, ...]:
    """Return what was known of the unit by hand, and so is no candidate, at the shafts that the model file states."""
    return tuple(
        BenchNumber(
            name=one.name,
            judges=one.id,
            value=one.value,
            uncertainty=one.uncertainty,
            unit=one.unit,
            shaft=None if one.is_of_effect else model.parameters[one.name].shaft,
            stated=one.stated,
            tolerance=one.tolerance,
            is_cause=one.is_off,
        )
        for one in model.measured.values()
    )


def take_measured(findings: Findings) -> bool:
    """Take in the causes that were measured, one after the other, and return whether there are any.

    Nobody is collinear with them, and nothing is asked of them: they were seen.
    """
    off = [one for one in findings.model.measured.values() if one.is_off]
    known = findings.model.as_stated()
    for id_ in dict.fromkeys(one.id for one in off):
        known = known.knowing(one for one in off if one.id == id_)
        found = _round(findings, known, id_)
        findings.rounds.append(found)
        take_in(findings, found)
    return bool(off)


def _round(findings: Findings, known: Model, id_: str) -> Round:
    """Return the round of a cause that was measured; `known` is the model with it, and without those after it."""
    before, balances = findings.final, findings.balances
    residual, segment = residual_of(balances), segment_of(balances)
    after = calibrate(known, balances)
    effect = CATALOGUE.get(id_)
    own = tuple(u for u in after.unknowns if effect is not None and u.place in effect.indices)
    frees = next((u.name for u in after.unknowns if decision.parameter_id(u.name) == id_), "")
    cause = Linearised(Candidate(id_, effect, (), own, frees), after.fit, after.unknowns, after.columns)
    groups = group_means(balances, cause.fit.whole)[0] / findings.final_floor.level
    if decision.excess(groups, findings.rows).sum() > 0.0:
        cause = bent(residual, cause, balances[0].load)
        groups = group_means(balances, cause.fit.whole)[0] / findings.final_floor.level
    t = held_out(cause.fit, cause.columns, cause.unknowns, segment).t_against(
        held_out(before.fit, before.columns, before.unknowns, segment)
    )
    found = cause.refined()
    return Round(before, [], [found], findings.final_groups, groups, t, 0.0, found)
