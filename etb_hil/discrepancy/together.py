"""A cause that a balance speaks against, tried again with another beside it: what is missing bends balances, too."""

from __future__ import annotations

from collections.abc import Sequence

from etb_hil.discrepancy import decision
from etb_hil.discrepancy.findings import Findings, Round
from etb_hil.discrepancy.objections import harms, is_only_harmful, objection
from etb_hil.discrepancy.rounds import Progress, go_back, one_round, take_in, taken_by


def stands_with_another(found: Round, findings: Findings, without: Sequence[str], progress: Progress) -> bool:
    """Take in a harmful cause and the next one if together they harm nothing; return whether they do.

    Otherwise everything is as it was. `without`: ids that are no suspects.
    """
    if not is_only_harmful(found, findings):
        return False
    progress(f"asking whether {found.winner.id} stands with another cause")
    standing, stands = findings.standing, False
    try:
        take_in(findings, found)
        other = _next(findings, without, progress)
        stands = other is not None and not harms(found.before_groups, findings.final_groups, findings)
        if other is not None and stands:
            findings.rounds.append(other)
    finally:
        if not stands:
            found.accepted = False
            go_back(findings, standing)
    return stands


def _next(findings: Findings, without: Sequence[str], progress: Progress) -> Round | None:
    """Return the next cause, taken in; none where nothing more is missing or the best suspect is none."""
    if not decision.is_more_missing(findings):
        return None
    other = one_round(findings, [*without, *taken_by(findings.accepted)], progress)
    if objection(other, findings):
        return None
    take_in(findings, other)
    return other
