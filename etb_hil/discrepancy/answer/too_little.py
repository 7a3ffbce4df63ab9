"""Why data tell nothing, or not enough for more than that a model is adequate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.commands import may_miss_commands
from etb_hil.discrepancy.measured.regimes import BESIDE
from etb_hil.discrepancy.search.findings import Findings

_LEAST = 10.0  # s


def nothing_to_judge(balances: Sequence[Balances]) -> list[str]:
    """Return why no balance of any stretch can be judged; nothing where one can."""
    if any(b.weights.any() for b in balances):
        return []
    what = f"{balances[0].measured.origin} has no row that could be judged"
    why = f"a value is missing or bad within {BESIDE:g} s of every row"
    return [f"{what}: {why}; look for losses, or leave a column out that has them"]


def too_little_to_accuse(findings: Findings) -> list[str]:
    """Return why what a model leaves over the noise may be none of its faults; nothing where it is, or leaves none."""
    if findings.verdict == "adequate" or findings.is_cut_short:
        return []
    return [*_too_short(findings.balances), *_too_slow(findings)]


def _too_short(balances: Sequence[Balances]) -> list[str]:
    seconds = sum(float(np.count_nonzero(b.regimes.is_good)) / b.spectrum.output_rate for b in balances)
    if seconds >= _LEAST:
        return []
    what = f"{balances[0].measured.origin}: the model leaves more than noise, in {seconds:.2g} s that can be judged"
    return [f"{what}; in less than {_LEAST:g} s a cause is not told from what happened once: measure 40 s"]


def _too_slow(findings: Findings) -> list[str]:
    found = [b.measured for b in findings.balances if may_miss_commands(b.measured, findings.model)]
    if not found:
        return []
    m = found[0]
    what = f"{m.origin}: the model leaves more than noise, and at {m.rate:.0f} Hz the voltage may change between rows"
    shows = (
        "no current tells" if m.current is None else "the current does not follow from what rows hold until the next"
    )
    remedy = "record at the rate of the controller's commands, 1 kHz or more"
    return [f"{what} ({shows}); a cause is not told from what was commanded there: {remedy}"]
