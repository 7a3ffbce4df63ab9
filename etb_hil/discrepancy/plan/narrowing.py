"""Narrowing of ambiguity groups by another record of the same unit.

The cause is in the ambiguity groups of both records.
"""

from __future__ import annotations

from collections.abc import Iterable

from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.results.explained.causes import Isolation

INFORMATIVE = ("explained", "ambiguous")  # verdicts of records whose ambiguity groups hold the cause


def left_open(ids: Iterable[str], judged: SelectionStep) -> list[str]:
    """Return those of some ids that a selection step does not exclude.

    These are its own ambiguity group, and what it could not test. Every base parameter is tested for collinearity with
    the cause, also those that are no candidates.
    """
    known = {one.candidate.id for one in judged.screened}
    known |= {decision.parameter_id(unknown.name) for unknown in judged.before.unknowns}
    return [id_ for id_ in ids if id_ not in known - {judged.winner.id, *judged.ambiguity_group}]


def narrow(findings: Findings, other: Findings) -> tuple[Isolation, ...]:
    """Remove from the ambiguity groups what another record of the unit excludes.

    Returns what that was. A record with a residual beyond its own causes, or in whose ambiguity groups the cause is
    not, excludes nothing.
    """
    if other.verdict not in INFORMATIVE:
        return ()
    found = []
    for each in findings.accepted:
        judged = next((r for r in other.accepted if each.winner.id in (r.winner.id, *r.ambiguity_group)), None)
        if judged is None:
            continue
        left = left_open(each.ambiguity_group, judged)
        gone = [id_ for id_ in each.ambiguity_group if id_ not in left]
        if gone:
            found.append(Isolation(each.winner.id, tuple(gone), other.balances[0].measured.origin))
        each.ambiguity_group = left
    findings.verdict = decision.verdict(findings)
    return tuple(found)
