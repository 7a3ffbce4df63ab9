"""EWMA and CUSUM: charts that add up small departures.

They find a shift that no single value shows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etb_hil.recording.samples import Float64

WEIGHT, EWMA_REACH = 0.2, 2.86  # in-control run length 370 (Lucas and Saccucci 1990, Technometrics 32)
SLACK, DECISION = 0.5, 4.77  # in sigma; likewise 370 (Hawkins 1993, Journal of Quality Technology 25)

# Mean number of units of a steady process until a signal; `benchmarks/history_study.py` measures these.
RUN_LENGTH = {"Nelson's rules": 148, "EWMA": 370, "CUSUM": 364, "all": 109}


@dataclass(frozen=True, slots=True)
class Shifts:
    """EWMA `mean` (n) with limits at `reach` (n), and CUSUM `above`, `below` (n).

    `reach` is the distance of the limits from 0.

    All in standard deviations from the centre; CUSUM signals above `DECISION`. `signals` maps the index of a value at
    which either signals to the reason.
    """

    mean: Float64
    reach: Float64
    above: Float64
    below: Float64
    signals: dict[int, str]


def shifts(departures: Float64) -> Shifts:
    """Return both charts of departures (n) from the centre in standard deviations.

    EWMA: z_i = w x_i + (1 - w) z_(i-1), limits +-L sqrt(w / (2 - w) (1 - (1 - w)^(2 i))) (Roberts 1959). CUSUM:
    s_i = max(0, s_(i-1) + x_i - k) and the same of -x_i (Page 1954).
    """
    count = len(departures)
    mean, above, below = np.empty(count), np.empty(count), np.empty(count)
    level = high = low = 0.0
    for index, value in enumerate(departures.tolist()):
        level = mean[index] = WEIGHT * value + (1.0 - WEIGHT) * level
        high = above[index] = max(0.0, high + value - SLACK)
        low = below[index] = max(0.0, low - value - SLACK)
    settled = 1.0 - (1.0 - WEIGHT) ** (2.0 * np.arange(1, count + 1))
    reach = EWMA_REACH * np.sqrt(WEIGHT / (2.0 - WEIGHT) * settled)
    signals: dict[int, str] = {}
    for index in np.flatnonzero((above > DECISION) | (below > DECISION)).tolist():
        signals[index] = f"CUSUM {'above' if above[index] > DECISION else 'below'} the centre"
    for index in np.flatnonzero(np.abs(mean) > reach).tolist():
        signals[index] = f"EWMA {'above' if mean[index] > 0.0 else 'below'} the centre"
    return Shifts(mean, reach, above, below, dict(sorted(signals.items())))
