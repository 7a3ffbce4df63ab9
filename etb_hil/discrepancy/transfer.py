"""Whether a cause that was found in one recording is in another: fitted parameters need not transfer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.calibration import all_unknowns, calibrate
from etb_hil.discrepancy.findings import Findings
from etb_hil.discrepancy.floor import floor_of, weigh

CARRIES = 0.02  # of the squared residual: what a cause must take of another recording to be carried over


def transfer(findings: Findings, others: Sequence[Balances]) -> list[dict[str, Any]]:
    """Return for each cause and other recording what the cause, as it was found, takes of its residual.

    The base parameters are calibrated anew for the other recording, with and without the cause.
    """
    found = []
    for other in others:
        stretches = [other]
        unknowns = all_unknowns(findings.model, stretches)
        plain = calibrate(findings.model, stretches)
        weigh(stretches, floor_of(findings.model, stretches, plain.fit.whole, unknowns).level)
        plain = calibrate(findings.model, stretches, plain.fit.whole)
        before = plain
        for each in findings.accepted:
            effect = each.winner.candidate.effect
            if effect is None:
                continue
            begin = before.fit.whole.copy()
            for place in effect.indices:
                begin[place] = findings.final.fit.whole[place]
            with_it = calibrate(findings.model, stretches, begin, unknowns)
            gain = 1.0 - with_it.fit.cost / before.fit.cost
            carried = gain > CARRIES
            found.append(
                {
                    "effect": effect.id,
                    "recording": other.measured.origin,
                    "gain": gain,
                    "carried_over": carried,
                    "says": "holds there, too" if carried else "does not hold there: it is not carried over",
                }
            )
            before = with_it if carried else before
    return found
