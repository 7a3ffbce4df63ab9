"""What another record of the same unit tells of what a record leaves open: the cause is in the class of both."""

from __future__ import annotations

from collections.abc import Iterable

from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.findings import Findings, Round
from etb_hil.results.explanation import ToldApart

TELLING = ("explained", "ambiguous")  # verdicts of records whose classes hold the cause


def left_open(ids: Iterable[str], judged: Round) -> list[str]:
    """Return of some ids those that a round could be about as well: its own class, and what it could not judge.

    Every base parameter is judged, as what is collinear with the cause, also those that are no candidates.
    """
    known = {one.candidate.id for one in judged.screened}
    known |= {decision.parameter_id(unknown.name) for unknown in judged.before.unknowns}
    return [id_ for id_ in ids if id_ not in known - {judged.winner.id, *judged.alike}]


def narrow(findings: Findings, other: Findings) -> tuple[ToldApart, ...]:
    """Take out of the classes of `findings` what another record of the same unit distinguishes; return what that was.

    A record that leaves more than its own causes account for, or in whose classes the cause is not, tells nothing.
    """
    if other.verdict not in TELLING:
        return ()
    found = []
    for each in findings.accepted:
        judged = next((r for r in other.accepted if each.winner.id in (r.winner.id, *r.alike)), None)
        if judged is None:
            continue
        left = left_open(each.alike, judged)
        gone = [id_ for id_ in each.alike if id_ not in left]
        if gone:
            found.append(ToldApart(each.winner.id, tuple(gone), other.balances[0].measured.origin))
        each.alike = left
    findings.verdict = decision.verdict(findings)
    return tuple(found)
