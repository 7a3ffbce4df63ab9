"""Accept the causes that the likelihood of the whole record finds.

The likelihood decides; the balances fit what was decided, for sizes, intervals and pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from etb_hil.discrepancy.candidates.candidate import (
    Candidate,
    Refined,
    beyond_judging,
    file_name,
    own_name,
    parameter_id,
    unjudged,
)
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration, residual_of
from etb_hil.discrepancy.fitting.cross_validation import t_of
from etb_hil.discrepancy.fitting.fit import fit_of, gauss_newton
from etb_hil.discrepancy.fitting.unknowns import Unknown, effect_unknowns
from etb_hil.discrepancy.measured.filter_record import as_record
from etb_hil.discrepancy.search.current_model import continue_from
from etb_hil.discrepancy.search.findings import Bristles, Compared, Findings, SelectionStep
from etb_hil.discrepancy.search.thresholds import beyond_chance, rejects
from etb_hil.estimation.record import joined
from etb_hil.hypotheses.comparison import Hypothesis
from etb_hil.hypotheses.constants import PARAMETER
from etb_hil.hypotheses.search import searched
from etb_hil.hypotheses.step import Step
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import ELASTIC, EXTENDED
from etb_hil.plant.effects.port import Port
from etb_hil.plant.physics import Vector
from etb_hil.recording.samples import Float64

_ITERATIONS = 10
_DRIFTS = "friction changes along the record; a change with time alone explains it as well or better"
_CHANNELS = {
    "torque": "torque",
    "voltage": "voltage",
    "current": "current's reading",
    "motor": "motor angle",
    "plate": "plate angle",
    "bridge": "voltage's reading",
}
_IDLE = "with the other causes it is not needed"


def accept_likely(findings: Findings, without: Sequence[str], progress: Callable[[str], None]) -> str:
    """Accept what the record needs beside the model, and return the verdict.

    `without`: ids that are not tried.

    What exceeds no balance of a healthy device is no fault of the model: the likelihood also sees what a bench does
    between its samples. The balances fit the instant at which a bench reads the plate, so that they do not show a plate
    that is late: effects that delay its reading are compared all the same.
    """
    balances = findings.balances
    is_as_healthy = not beyond_chance(findings.final_groups, findings.samples).any()
    made = joined([as_record(b.measured, findings.model) for b in balances])
    if findings.bristles is Bristles.OPEN:
        made = made.with_open_bristles()
    names = {parameter_id(unknown.name) for unknown in findings.final.unknowns} - set(findings.tested)
    out = [*without, *beyond_judging(balances), *map(own_name, names)]
    ids = _free_in_balances() if is_as_healthy else None
    found = findings.found = searched(made, findings.model, out, progress, ids)
    if is_as_healthy and not found.causes and not found.is_interrupted:
        return "explained" if findings.accepted else "adequate"
    for step in found.causes:
        _accept(findings, step)
    if not found.causes:
        # A hill may have held the balances' fit, which began at the stated numbers.
        continue_from(findings, _near(findings.final.fit.whole, found.final.parameters), findings.final.unknowns)
    accepted = {id_ for cause in found.causes for id_ in cause.best.ids}
    for step in found.steps:
        named = [one for one in step.hypotheses if not one.is_drift and not accepted & set(one.ids)]
        if named and not accepted & set(step.best.ids):
            findings.selection_steps.append(_rejected(findings, step, named[0]))
    if found.is_interrupted:
        raise KeyboardInterrupt
    if not found.needed and not rejects(findings.final_groups, findings.samples):
        return "explained" if findings.accepted else "adequate"
    if not findings.accepted or found.verdict == "unexplained":
        return found.verdict
    return "ambiguous" if any(each.ambiguity_group for each in findings.accepted) else "explained"


def _free_in_balances() -> list[str]:
    """Return the effects that delay the plate's reading: the balances fit its instant."""
    return [id_ for id_, effect in CATALOGUE.items() if effect.acts_at(Port.PLATE_LATENESS)]


def _accept(findings: Findings, step: Step) -> None:
    """Accept a cause; parameters that leave their tolerances together are one each."""
    ids = [file_name(id_) for id_ in step.best.ids]
    group = {file_name(id_) for one in step.group for id_ in one.ids}
    group.update(id_ for each in ids for id_ in unjudged(findings.balances, each))
    before = findings.final
    winner, t = _fitted(findings, before, step.best)
    for k, id_ in enumerate(ids):
        candidate = replace(winner.candidate, id=id_, frees=winner.candidate.frees[k : k + 1])
        compared = _compared(step) if k == 0 else ()  # the first one has what was compared
        found = SelectionStep(before, replace(winner, candidate=candidate), compared, t)
        found.ambiguity_group = sorted(group - set(ids))
        found.accepted = True
        findings.selection_steps.append(found)
    continue_from(findings, winner.fit.whole, winner.unknowns)


def _rejected(findings: Findings, step: Step, best: Hypothesis) -> SelectionStep:
    """Return the step of a hypothesis that is no cause."""
    before = findings.final
    winner = Refined(_candidate(best), before.fit, before.unknowns)
    found = SelectionStep(before, winner, _compared(step))
    part = step.misfit.largest
    left = best.misfit[part] / step.misfit[part]
    if step.best is not best:
        found.rejection = _DRIFTS
    elif not best.misfit.lessens(step.misfit, step.shares):
        most = f"at most {100.0 * step.shares[part]:.0f} % is required"
        what = f"misfit of the {_CHANNELS[step.misfit._fields[part]]}"
        found.rejection = f"the {what} with it is {100.0 * left:.0f} % of that without it; {most}"
    else:
        found.rejection = _IDLE
    return found


def _compared(step: Step) -> tuple[Compared, ...]:
    """Return what was compared and has a name."""
    return tuple(
        Compared(
            tuple(file_name(id_) for id_ in one.ids),
            one.evidence,
            one.misfit.share_of(step.misfit, step.best.misfit),
            one.fit.parameters[:EXTENDED],
        )
        for one in step.hypotheses
        if not one.is_drift
    )


def _fitted(findings: Findings, before: Calibration, best: Hypothesis) -> tuple[Refined, float]:
    """Return a hypothesis fitted in the balances, from where the likelihood has it.

    The base model is that of the balances or that of the likelihood, whichever leaves less. The second value is
    Student's t of what it explains of held-out segments.
    """
    residual, first = residual_of(findings.balances), findings.balances[0]
    candidate, whole = _candidate(best), before.fit.whole
    begins = [fit_of(residual, begin) for begin in (_near(whole, best.fit.parameters), best.added_to(whole))]
    begin = min(begins, key=lambda one: one.cost)
    unknowns = _unknowns_of(before.unknowns, candidate, begin.whole, first)
    found = Calibration(unknowns, *gauss_newton(residual, begin, unknowns, _ITERATIONS))
    return Refined(candidate, found.fit, found.unknowns), t_of(found, before, findings.balances)


def _near(whole: Vector, parameters: Float64) -> Vector:
    """Return a whole vector of the balances with the parameters of the likelihood."""
    found = whole.copy()
    found[:EXTENDED] = parameters[:EXTENDED]
    found[ELASTIC] = whole[ELASTIC]  # as model files have it: what is written is what is judged
    return found


def _candidate(best: Hypothesis) -> Candidate:
    """Return the candidate of the balances that a hypothesis is."""
    first = best.ids[0]
    if first in CATALOGUE:
        return Candidate(first, CATALOGUE[first])
    return Candidate(file_name(first), frees=tuple(id_.removeprefix(PARAMETER) for id_ in best.ids))


def _unknowns_of(base: Sequence[Unknown], candidate: Candidate, start: Vector, first: Balances) -> list[Unknown]:
    """Return the unknowns of a candidate's fit: base, freed ones, the effect's."""
    moved = [u.free() if u.name in candidate.frees else u for u in base]
    if candidate.effect is None:
        return moved
    shapes = [float(start[place]) for place in candidate.effect.indices]
    return moved + effect_unknowns(candidate.effect, shapes, first.load, first.largest)
