"""Joint tests: a rejected cause with another, or in place of an earlier one.

A missing cause biases the balances and masks how well another one holds. A candidate that approximates two causes at
once masks both.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.current_model import accept, restore
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.discrepancy.search.reconsideration import try_replacement
from etb_hil.discrepancy.search.rejection import (
    explains_nearly_all,
    fails_on_other_segments,
    harms,
    has_no_full_period,
    is_ambiguous_with_a_cause,
    is_collinear_with_base,
    is_one_of_several,
    is_open,
    is_third,
    reason_to_reject,
)
from etb_hil.discrepancy.search.selection import Progress, accepted_ids, selection_step


def accept_with_another(found: SelectionStep, findings: Findings, without: Sequence[str], progress: Progress) -> bool:
    """Accept a rejected cause and the next one if together nothing contradicts them.

    Otherwise nothing changes. `without`: ids that are not tested.
    """
    if not is_open(found, findings, has_no_full_period):
        return False
    progress(f"testing whether {found.winner.id} is significant with another cause")
    with _on_trial(found, findings) as trial:
        other = _next(findings, without, progress)
        if other is not None:
            findings.selection_steps.append(other)
            stands = not harms(found.before_groups, findings.final_groups, findings)
            if stands and (fails_on_other_segments(found, findings) or has_no_full_period(found, findings)):
                stands = explains_nearly_all(other, findings) and _is_jointly_significant(
                    found, findings, without, progress
                )
            trial.stands = stands
    return trial.stands


def accept_by_replacing(found: SelectionStep, findings: Findings, without: Sequence[str], progress: Progress) -> bool:
    """Accept a shared later cause if, given it, another one replaces an earlier cause.

    An earlier cause that approximates two leaves what no true one explains nearly all of. Both are searched for again
    given each other, and must pass all criteria; otherwise nothing changes. `without`: ids that are not tested.
    """
    shared = (is_collinear_with_base, is_one_of_several)
    is_shared = any(criterion(found, findings) for criterion in shared)
    if not is_shared or not is_open(found, findings, *shared, is_third):
        return False
    earlier = findings.accepted
    with _on_trial(found, findings) as trial:
        replaced = [old for old in earlier if try_replacement(findings, old, without, progress, is_wrong=False)]
        trial.stands = bool(replaced) and try_replacement(findings, found, without, progress, is_wrong=True)
    return trial.stands


def accept_if_jointly_significant(
    found: SelectionStep, findings: Findings, without: Sequence[str], progress: Progress
) -> bool:
    """Accept a later cause ambiguous with an earlier one if both are significant.

    Each must explain nearly all of the residual given the other: causes that are not isolable leave each other nothing.
    A parametric fault explains its part given anything, and is not tested. Otherwise nothing changes.
    """
    if not explains_nearly_all(found, findings) or not is_open(found, findings, is_ambiguous_with_a_cause):
        return False
    competitors = [
        old
        for old in findings.accepted
        if old.winner.id in found.ambiguity_group or found.winner.id in old.ambiguity_group
    ]
    if not competitors or any(each.winner.candidate.effect is None for each in (found, *competitors)):
        return False
    progress(f"testing whether {found.winner.id} is jointly significant with its competing hypothesis")
    with _on_trial(found, findings) as trial:
        trial.stands = all(_is_jointly_significant(old, findings, without, progress) for old in competitors)
    return trial.stands


@dataclass
class _Trial:
    """Whether a cause accepted on trial holds."""

    stands: bool = False


@contextmanager
def _on_trial(found: SelectionStep, findings: Findings) -> Iterator[_Trial]:
    """Accept a cause on trial; unless it holds, or after an interrupt, undo it."""
    earlier, current_model, selection_steps, trial = (
        findings.accepted,
        findings.current_model,
        list(findings.selection_steps),
        _Trial(),
    )
    try:
        accept(findings, found)
        yield trial
    finally:
        if not trial.stands:
            found.accepted = False
            findings.selection_steps[:] = selection_steps
            for old in earlier:
                old.accepted = True
            restore(findings, current_model)


def _next(findings: Findings, without: Sequence[str], progress: Progress) -> SelectionStep | None:
    """Return the next cause, accepted; None if nothing is missing or it is rejected."""
    if not decision.is_more_missing(findings):
        return None
    other = selection_step(findings, [*without, *accepted_ids(findings.accepted)], progress)
    if reason_to_reject(other, findings):
        return None
    accept(findings, other)
    return other


def _is_jointly_significant(
    found: SelectionStep, findings: Findings, without: Sequence[str], progress: Progress
) -> bool:
    """Search again in place of a cause; tell whether a valid one explains nearly all."""
    place = findings.selection_steps.index(found)
    if not try_replacement(findings, found, without, progress, is_wrong=True):
        return False
    return explains_nearly_all(findings.selection_steps[place], findings)
