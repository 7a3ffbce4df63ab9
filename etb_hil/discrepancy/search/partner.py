"""What was let out of its box along with a parametric fault: a cause of its own, taken in with it."""

from __future__ import annotations

from etb_hil.discrepancy.fitting.calibration import Calibration, residual_of
from etb_hil.discrepancy.fitting.fit import columns
from etb_hil.discrepancy.fitting.floor import group_means
from etb_hil.discrepancy.fitting.segments import held_out, segment_of
from etb_hil.discrepancy.search.findings import Findings, Round
from etb_hil.discrepancy.suspects.candidates import Candidate, parameter_id
from etb_hil.discrepancy.suspects.refining import Refined, by_itself


def part(findings: Findings, found: Round) -> list[Round]:
    """Let a round's winner be one number, and return the round of what was let out along with it; none where none was.

    What looks like both together is in the class of either, and neither in the other's: each is wrong beside the other.
    """
    winner = found.winner
    along = winner.candidate.along
    if not along:
        return []
    residual, segment = residual_of(findings.balances), segment_of(findings.balances)
    alone = by_itself(residual, winner)
    partner = Refined(Candidate(parameter_id(along), None, (), (), along), winner.fit, winner.unknowns)
    found.refined[0] = Refined(alone.candidate, winner.fit, winner.unknowns)
    found.alike = [id_ for id_ in found.alike if id_ != partner.id]
    before = Calibration(alone.unknowns, alone.fit, alone.columns)
    groups = group_means(findings.balances, alone.fit.whole)[0] / findings.final_floor.level
    there = columns(residual, winner.fit, winner.unknowns)
    t = held_out(winner.fit, there, winner.unknowns, segment).t_against(
        held_out(alone.fit, alone.columns, alone.unknowns, segment)
    )
    return [Round(before, [], [partner], groups, found.after_groups, t, 0.0, partner, list(found.alike))]
