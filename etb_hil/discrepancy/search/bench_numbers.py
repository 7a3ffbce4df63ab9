"""Bench measurements: those off their nominal are causes before any search."""

from __future__ import annotations

from etb_hil.discrepancy.candidates.candidate import Candidate, Refined, parameter_id
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.fitting.cross_validation import t_of
from etb_hil.discrepancy.fitting.noise_floor import group_means
from etb_hil.discrepancy.fitting.unknowns import finer_unknowns
from etb_hil.discrepancy.search.current_model import continue_from
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.discrepancy.search.thresholds import excess
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


def accept_measured(findings: Findings) -> None:
    """Accept the causes that were measured.

    Nothing is ambiguous with them, and no criterion is applied: they were seen.
    """
    off = [one for one in findings.model.measured.values() if one.is_off]
    known = findings.model.as_stated()
    for id_ in dict.fromkeys(one.id for one in off):
        known = known.knowing(one for one in off if one.id == id_)
        found = _step(findings, known, id_)
        findings.selection_steps.append(found)
        found.accepted = True
        continue_from(findings, found.winner.fit.whole, found.winner.unknowns)


def _step(findings: Findings, known: Model, id_: str) -> SelectionStep:
    """Return the selection step of a measured cause; `known`: the model with it."""
    before, balances = findings.final, findings.balances
    after = calibrate(known, balances)
    effect = CATALOGUE.get(id_)
    frees = tuple(u.name for u in after.unknowns if parameter_id(u.name) == id_)
    groups = group_means(balances, after.fit.whole)[0] / findings.final_noise_floor.level
    if effect is not None and effect.finer and excess(groups, findings.samples).sum() > 0.0:
        more = [*after.unknowns, *finer_unknowns(effect, balances[0].load)]
        after = calibrate(known, balances, after.fit.whole, more)
    winner = Refined(Candidate(id_, effect, frees), after.fit, after.unknowns)
    return SelectionStep(before, winner, (), t_of(after, before, balances))
