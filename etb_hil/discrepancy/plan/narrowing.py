"""Narrowing of ambiguity groups by another record of the same unit.

The cause is in the ambiguity groups of both records.
"""

from __future__ import annotations

from etb_hil.discrepancy.candidates.candidate import parameter_id
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.results.explained.causes import Isolation

INFORMATIVE = ("explained", "ambiguous")  # verdicts of records whose ambiguity groups hold the cause


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
        gone = _excluded(each.ambiguity_group, judged, other)
        if gone:
            found.append(Isolation(each.winner.id, tuple(gone), other.balances[0].measured.origin))
        each.ambiguity_group = [id_ for id_ in each.ambiguity_group if id_ not in gone]
    if findings.verdict == "ambiguous" and not any(each.ambiguity_group for each in findings.accepted):
        findings.verdict = "explained"
    return tuple(found)


def _excluded(ids: list[str], judged: SelectionStep, other: Findings) -> list[str]:
    """Return those of some ids that a record tested and excludes beside its cause."""
    tested = set(other.tested) | {parameter_id(unknown.name) for unknown in other.calibration.unknowns}
    return [id_ for id_ in ids if id_ in tested - {judged.winner.id, *judged.ambiguity_group}]
