"""Reasons why data are insufficient for a verdict."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.missed_commands import FAST, may_miss_commands, rate_of_voltage
from etb_hil.discrepancy.measured.regimes import GUARD_TIME
from etb_hil.discrepancy.search.findings import Findings
from etb_hil.plant.parameters import Model

_LEAST = 10.0  # s


def nothing_to_judge(balances: Sequence[Balances]) -> list[str]:
    """Return why no balance of any segment can be judged; empty if one can."""
    if any(b.weights.any() for b in balances):
        return []
    what = f"{balances[0].measured.origin} has no sample that could be judged"
    why = f"a value is missing or bad within {GUARD_TIME:g} s of every sample"
    return [f"{what}: {why}; look for lost frames, or leave out the signal that has them"]


def too_little_to_reject(findings: Findings, segments: Sequence[Measurement]) -> list[str]:
    """Return why a residual may not be the model's; empty if it is, or there is none.

    `segments`: the measurements as they were recorded, from which the findings' balances were made.
    """
    if findings.verdict in ("adequate", "insufficient_data"):
        return []
    return [*_too_short(findings.balances), *_too_slow(segments, findings.model)]


def _too_short(balances: Sequence[Balances]) -> list[str]:
    seconds = sum(float(np.count_nonzero(b.regimes.is_good)) / b.spectrum.output_rate for b in balances)
    if seconds >= _LEAST:
        return []
    what = f"{balances[0].measured.origin}: the residual exceeds the noise, in {seconds:.2g} s that can be judged"
    return [f"{what}; at least {_LEAST:g} s are needed to distinguish a cause from a single event: measure 40 s"]


def _too_slow(segments: Sequence[Measurement], model: Model) -> list[str]:
    m = next((each for each in segments if may_miss_commands(each, model)), None)
    if m is None:
        return []
    rate = rate_of_voltage(m)
    what = f"{m.origin}: the residual exceeds the noise, and at {rate:.0f} Hz the voltage may change between samples"
    if m.current is None:
        shows = f"below {FAST:g} Hz a record without a current does not show such changes"
        remedy = f"record the current, too, or at {FAST:g} Hz or more"
    else:
        shows = "the current changes before the recorded voltage does"
        remedy = "record in step with the controller's commands, or several times as fast"
    return [f"{what}: {shows}; the data cannot distinguish a cause from such a command: {remedy}"]
