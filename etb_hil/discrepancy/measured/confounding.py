"""Confounded conditions: those that only ever changed together."""

from __future__ import annotations

import numpy as np

from etb_hil.discrepancy.measured.measurement import CHANGES
from etb_hil.recording.recording import Recording
from etb_hil.recording.samples import Float64
from etb_hil.results.explained.residual import Confounded

_CONDITIONS = {
    "pwm_frequency": "PWM frequency",
    "temperature": "temperature",
    "supply_voltage": "supply voltage",
}
_TOGETHER = 0.95
_VARIES = 0.02  # of its mean: less is no change of the condition
_MOST_SAMPLES = 20_000


def confounded(recording: Recording) -> list[Confounded]:
    """Return conditions confounded with time or each other, and a test for each."""
    series = {}
    for role, name in _CONDITIONS.items():
        if role in recording.roles:
            one = recording.series(role)
            known = np.isfinite(one.values)
            values, time_ns = one.values[known], one.time_ns[known]
            if len(values) > 2 and float(np.ptp(values)) > _least_change(role, values):
                series[name] = (time_ns, values)
    found = []
    names = list(series)
    for k, name in enumerate(names):
        time_ns, values = series[name]
        own = _rank_correlation(time_ns.astype(np.float64), values)
        if abs(own) >= _TOGETHER:
            found.append(_said(name, "elapsed time", own, f"repeat the first {name} at the end, or shuffle its order"))
        for other in names[k + 1 :]:
            aligned = np.interp(time_ns, *series[other])
            both = _rank_correlation(aligned, values)
            if abs(both) >= _TOGETHER:
                found.append(_said(name, other, both, f"change {name} while {other} is held"))
    return found


def _least_change(role: str, values: Float64) -> float:
    """Return the span that counts as a change of a condition; of a temperature in K."""
    return CHANGES if role == "temperature" else _VARIES * max(abs(float(np.mean(values))), 1e-12)


def _said(first: str, second: str, correlation: float, test: str) -> Confounded:
    return Confounded(
        conditions=f"{first} and {second}",
        pair=(first, second),
        test=test[0].upper() + test[1:] + ".",
        rank_correlation=correlation,
        text=f"they changed together throughout, so that their effects cannot be distinguished; {test}.",
    )


def _rank_correlation(x: Float64, y: Float64) -> float:
    """Return Spearman's rank correlation, ties at their mean rank."""
    step = max(1, len(x) // _MOST_SAMPLES)
    return float(np.corrcoef(_ranks(x[::step]), _ranks(y[::step]))[0, 1])


def _ranks(values: Float64) -> Float64:
    _, place, count = np.unique(values, return_inverse=True, return_counts=True)
    last = np.cumsum(count)
    return (last - 0.5 * (count - 1.0))[place]
