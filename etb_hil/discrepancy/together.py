"""A cause that a balance or held-out segments speak against, tried again with another beside it.

What is missing bends balances, and hides how well a cause holds.
"""

from __future__ import annotations

from collections.abc import Sequence

from etb_hil.discrepancy import decision
from etb_hil.discrepancy.findings import Findings, Round
from etb_hil.discrepancy.objections import fails_on_other_segments, harms, is_open, objection, takes_nearly_all
from etb_hil.discrepancy.reconsidering import is_replaced
from etb_hil.discrepancy.rounds import Progress, go_back, one_round, take_in, taken_by


def stands_with_another(found: Round, findings: Findings, without: Sequence[str], progress: Progress) -> bool:
    """Take in a cause that something missing may speak against, and the next one, if together nothing does any more.

    Otherwise everything is as it was. `without`: ids that are no suspects.
    """
    if not is_open(found, findings):
        return False
    progress(f"asking whether {found.winner.id} stands with another cause")
    standing, rounds, stands = findings.standing, list(findings.rounds), False
    try:
        take_in(findings, found)
        other = _next(findings, without, progress)
        if other is not None:
            findings.rounds.append(other)
            stands = not harms(found.before_groups, findings.final_groups, findings)
            if stands and fails_on_other_segments(found, findings):
                stands = takes_nearly_all(other, findings) and _holds_beside(found, findings, without, progress)
    finally:
        if not stands:
            found.accepted = False
            findings.rounds[:] = rounds
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


def _holds_beside(found: Round, findings: Findings, without: Sequence[str], progress: Progress) -> bool:
    """Search again in place of a cause beside the other; return whether one by all rules takes nearly all there."""
    place = findings.rounds.index(found)
    if not is_replaced(findings, found, without, progress, is_wrong=True):
        return False
    return takes_nearly_all(findings.rounds[place], findings)
