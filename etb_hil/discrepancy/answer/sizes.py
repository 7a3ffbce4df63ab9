"""Sizes of what was found, with their intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from etb_hil.discrepancy.fitting.intervals import TELLS, Estimate, estimates
from etb_hil.discrepancy.search.findings import Findings
from etb_hil.estimation.climbing import Fitted
from etb_hil.estimation.unknown import Unknown

_NORMAL = 1.96  # standard deviations of half a 95 % interval


def sizes(findings: Findings) -> list[Estimate]:
    """Return every unknown of the model with all causes, with its interval.

    The balances have one angle for the motion. What they do not identify of an effect, the likelihood of all readings
    may: then value and interval are those of its fit.
    """
    found = estimates(findings.final, findings.balances, findings.final_noise_floor)
    if findings.found is None:
        return found
    fit = findings.found.final
    likely = {one.place: one for one in fit.unknowns if one.effect is not None}
    return [one if one.is_identifiable else _by_likelihood(one, fit, likely) for one in found]


def _by_likelihood(estimate: Estimate, fit: Fitted, likely: Mapping[int, Unknown]) -> Estimate:
    """Return an estimate with the likelihood's interval, where that tells anything."""
    unknown = likely.get(estimate.place)
    if unknown is None:
        return estimate
    value, deviation = fit.value(unknown.name)
    low, high = max(value - _NORMAL * deviation, unknown.low), min(value + _NORMAL * deviation, unknown.high)
    if high - low >= TELLS * (unknown.high - unknown.low):
        return estimate
    return replace(estimate, value=value, low=low, high=high, on_bound=False, is_identifiable=True)
