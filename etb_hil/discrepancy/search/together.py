"""A cause that something speaks against, tried again with another beside it, or in place of an earlier one.

What is missing bends balances, and hides how well a cause holds; what stands in for two causes hides what either takes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.findings import Findings, Round
from etb_hil.discrepancy.search.objections import (
    fails_on_other_segments,
    harms,
    is_imitated,
    is_in_a_class,
    is_no_wave,
    is_one_of_several,
    is_open,
    is_third,
    objection,
    takes_nearly_all,
)
from etb_hil.discrepancy.search.reconsidering import is_replaced
from etb_hil.discrepancy.search.rounds import Progress, one_round, taken_by
from etb_hil.discrepancy.search.standing import go_back, take_in


def stands_with_another(found: Round, findings: Findings, without: Sequence[str], progress: Progress) -> bool:
    """Take in a cause that something missing may speak against, and the next one, if together nothing does any more.

    Otherwise everything is as it was. `without`: ids that are no candidates.
    """
    if not is_open(found, findings, is_no_wave):
        return False
    progress(f"asking whether {found.winner.id} stands with another cause")
    with _on_trial(found, findings) as trial:
        other = _next(findings, without, progress)
        if other is not None:
            findings.rounds.append(other)
            stands = not harms(found.before_groups, findings.final_groups, findings)
            if stands and (fails_on_other_segments(found, findings) or is_no_wave(found, findings)):
                stands = takes_nearly_all(other, findings) and _holds_beside(found, findings, without, progress)
            trial.stands = stands
    return trial.stands


def stands_in_place(found: Round, findings: Findings, without: Sequence[str], progress: Progress) -> bool:
    """Take in a later cause that others do nearly as well as where, beside it, another one replaces an earlier cause.

    What an earlier cause that stands in for two leaves, no true one takes nearly all of. Both are searched for again
    beside each other, and have to be causes by all rules; otherwise everything is as it was. `without`: ids that are no
    candidates.
    """
    shared = (is_imitated, is_one_of_several)
    is_shared = any(object_to(found, findings) for object_to in shared)
    if not is_shared or not is_open(found, findings, *shared, is_third):
        return False
    earlier = findings.accepted
    with _on_trial(found, findings) as trial:
        replaced = [old for old in earlier if is_replaced(findings, old, without, progress, is_wrong=False)]
        trial.stands = bool(replaced) and is_replaced(findings, found, without, progress, is_wrong=True)
    return trial.stands


def stands_beside_its_rival(found: Round, findings: Findings, without: Sequence[str], progress: Progress) -> bool:
    """Take in a later cause in whose class an earlier one is, or it in that one's, if each takes nearly all beside it.

    What cannot be distinguished leaves each other nothing to take; a parametric fault takes its part beside
    anything, and is not asked. Otherwise everything is as it was. `without`: ids that are no candidates.
    """
    if not takes_nearly_all(found, findings) or not is_open(found, findings, is_in_a_class):
        return False
    rivals = [old for old in findings.accepted if old.winner.id in found.alike or found.winner.id in old.alike]
    if not rivals or any(each.winner.candidate.effect is None for each in (found, *rivals)):
        return False
    progress(f"asking whether {found.winner.id} is jointly significant with its competing hypothesis")
    with _on_trial(found, findings) as trial:
        trial.stands = all(_holds_beside(old, findings, without, progress) for old in rivals)
    return trial.stands


@dataclass
class _Trial:
    """Whether what was taken in on trial stands."""

    stands: bool = False


@contextmanager
def _on_trial(found: Round, findings: Findings) -> Iterator[_Trial]:
    """Take in a cause for a while; unless it stands in the end, an interrupt included, all is as it was."""
    earlier, standing, rounds, trial = findings.accepted, findings.standing, list(findings.rounds), _Trial()
    try:
        take_in(findings, found)
        yield trial
    finally:
        if not trial.stands:
            found.accepted = False
            findings.rounds[:] = rounds
            for old in earlier:
                old.accepted = True
            go_back(findings, standing)


def _next(findings: Findings, without: Sequence[str], progress: Progress) -> Round | None:
    """Return the next cause, taken in; none where nothing more is missing or the best candidate is none."""
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
