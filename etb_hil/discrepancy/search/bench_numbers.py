"""Bench measurements: those off their nominal are causes before any search."""

from __future__ import annotations

from etb_hil.discrepancy.candidates.candidate import Candidate
from etb_hil.discrepancy.candidates.refinement import Linearised, fit_finer_shapes
from etb_hil.discrepancy.fitting.calibration import calibrate, residual_of
from etb_hil.discrepancy.fitting.cross_validation import fold_of, held_out
from etb_hil.discrepancy.fitting.noise_floor import group_means
from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.current_model import accept
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.parameters import Model
from etb_hil.results.explained.causes import MeasuredParameter


def bench_numbers(model: Model) -> tuple[MeasuredParameter, ...]:
    """Return the parameters measured at the bench, at the model file's shafts."""
    return tuple(
        MeasuredParameter(
            name=one.name,
            candidate=one.id,
            value=one.value,
            uncertainty=one.uncertainty,
            unit=one.unit,
            shaft=None if one.is_of_effect else model.parameters[one.name].shaft,
            nominal=one.stated,
            tolerance=one.tolerance,
            is_cause=one.is_off,
        )
        for one in model.measured.values()
    )


def accept_measured(findings: Findings) -> bool:
    """Accept the causes that were measured, and return whether there are any.

    Nothing is ambiguous with them, and no criterion is applied: they were seen.
    """
    off = [one for one in findings.model.measured.values() if one.is_off]
    known = findings.model.as_stated()
    for id_ in dict.fromkeys(one.id for one in off):
        known = known.knowing(one for one in off if one.id == id_)
        found = _step(findings, known, id_)
        findings.selection_steps.append(found)
        accept(findings, found)
    return bool(off)


def _step(findings: Findings, known: Model, id_: str) -> SelectionStep:
    """Return the selection step of a measured cause; `known`: the model with it."""
    before, balances = findings.final, findings.balances
    residual, segment = residual_of(balances), fold_of(balances)
    after = calibrate(known, balances)
    effect = CATALOGUE.get(id_)
    own = tuple(u for u in after.unknowns if effect is not None and u.place in effect.indices)
    frees = next((u.name for u in after.unknowns if decision.parameter_id(u.name) == id_), "")
    cause = Linearised(Candidate(id_, effect, (), own, frees), after.fit, after.unknowns, after.jacobian)
    groups = group_means(balances, cause.fit.whole)[0] / findings.final_noise_floor.level
    if decision.excess(groups, findings.samples).sum() > 0.0:
        cause = fit_finer_shapes(residual, cause, balances[0].load)
        groups = group_means(balances, cause.fit.whole)[0] / findings.final_noise_floor.level
    t = held_out(cause.fit, cause.jacobian, cause.unknowns, segment).t_against(
        held_out(before.fit, before.jacobian, before.unknowns, segment)
    )
    found = cause.refined()
    return SelectionStep(before, [], [found], findings.final_groups, groups, t, 0.0, found)
