"""Why data tell nothing, or not enough for more than that a model is adequate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.commands import may_miss_commands, rate_of_voltage
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.regimes import BESIDE
from etb_hil.discrepancy.search.findings import Findings
from etb_hil.plant.parameters import Model

_LEAST = 10.0  # s


def nothing_to_judge(balances: Sequence[Balances]) -> list[str]:
    """Return why no balance of any segment can be judged; nothing where one can."""
    if any(b.weights.any() for b in balances):
        return []
    what = f"{balances[0].measured.origin} has no row that could be judged"
    why = f"a value is missing or bad within {BESIDE:g} s of every row"
    return [f"{what}: {why}; look for losses, or leave a column out that has them"]


def too_little_to_accuse(findings: Findings, stretches: Sequence[Measurement]) -> list[str]:
    """Return why what a model leaves over the noise may be none of its faults; nothing where it is, or leaves none.

    `stretches`: the measurements as they were recorded, from which the findings' balances were made.
    """
    if findings.verdict in ("adequate", "insufficient_data"):
        return []
    return [*_too_short(findings.balances), *_too_slow(stretches, findings.model)]


def _too_short(balances: Sequence[Balances]) -> list[str]:
    seconds = sum(float(np.count_nonzero(b.regimes.is_good)) / b.spectrum.output_rate for b in balances)
    if seconds >= _LEAST:
        return []
    what = f"{balances[0].measured.origin}: the model leaves more than noise, in {seconds:.2g} s that can be judged"
    return [f"{what}; in less than {_LEAST:g} s a cause is not told from what happened once: measure 40 s"]


def _too_slow(stretches: Sequence[Measurement], model: Model) -> list[str]:
    m = next((each for each in stretches if may_miss_commands(each, model)), None)
    if m is None:
        return []
    rate = rate_of_voltage(m)
    what = f"{m.origin}: the model leaves more than noise, and at {rate:.0f} Hz the voltage may change between rows"
    shows = "no current tells" if m.current is None else "the current answers it before the row that shows it"
    remedy = "record in step with the controller's commands, or several times as fast"
    return [f"{what} ({shows}); a cause is not told from what was commanded there: {remedy}"]
