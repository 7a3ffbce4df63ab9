"""A parameter freed jointly with a parametric fault: a cause of its own."""

from __future__ import annotations

from etb_hil.discrepancy.candidates.candidate import Candidate, parameter_id
from etb_hil.discrepancy.candidates.refinement import Refined, by_itself
from etb_hil.discrepancy.fitting.calibration import Calibration, residual_of
from etb_hil.discrepancy.fitting.cross_validation import fold_of, held_out
from etb_hil.discrepancy.fitting.fit import jacobian
from etb_hil.discrepancy.fitting.noise_floor import group_means
from etb_hil.discrepancy.search.findings import Findings, SelectionStep


def split_joint(findings: Findings, found: SelectionStep) -> list[SelectionStep]:
    """Split a winner with two freed parameters; return the step of the second one.

    Empty where only one was freed. What is ambiguous with both together is in the ambiguity group of either, and
    neither is in the other's.
    """
    winner = found.winner
    also_frees = winner.candidate.also_frees
    if not also_frees:
        return []
    residual, segment = residual_of(findings.balances), fold_of(findings.balances)
    alone = by_itself(residual, winner)
    partner = Refined(Candidate(parameter_id(also_frees), None, (), (), also_frees), winner.fit, winner.unknowns)
    found.refined[0] = Refined(alone.candidate, winner.fit, winner.unknowns)
    found.ambiguity_group = [id_ for id_ in found.ambiguity_group if id_ != partner.id]
    before = Calibration(alone.unknowns, alone.fit, alone.jacobian)
    groups = group_means(findings.balances, alone.fit.whole)[0] / findings.final_noise_floor.level
    there = jacobian(residual, winner.fit, winner.unknowns)
    t = held_out(winner.fit, there, winner.unknowns, segment).t_against(
        held_out(alone.fit, alone.jacobian, alone.unknowns, segment)
    )
    return [
        SelectionStep(before, [], [partner], groups, found.after_groups, t, 0.0, partner, list(found.ambiguity_group))
    ]
