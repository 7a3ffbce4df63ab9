"""Control charts of individual values with their moving range.

Nelson's rules apply, and beside them EWMA and CUSUM.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from etb_hil.histories.rounding import without_rounding
from etb_hil.histories.shift import Shifts, shifts
from etb_hil.recording.samples import Float64

FEWEST = 8  # values, for limits that mean something
D2 = 1.128  # mean range of two normal values, in standard deviations (AIAG, SPC manual 2005, appendix E)
D4 = 3.267  # upper limit of a range of two, in mean ranges (likewise)
_SIDE, _STEADY = 9, 6  # Nelson (1984): so many on one side of the centre; so many steadily rising or falling


@dataclass(frozen=True, slots=True)
class ControlChart:
    """A chart of individuals: values (n) and moving ranges (n - 1).

    Both have centre lines and limits.

    `sigma` is the standard deviation from one value to the next, without slow movements. `signals` maps the index of
    a value against which one of Nelson's rules speaks to the reason; `shifts` are EWMA and CUSUM of the same values.
    `least` is the smallest possible value.
    """

    values: Float64
    ranges: Float64
    centre: float
    sigma: float
    signals: dict[int, str]
    shifts: Shifts
    least: float

    @property
    def is_steady(self) -> bool:
        """Whether neither a rule nor EWMA nor CUSUM speaks against a steady process."""
        return not self.signals and not self.shifts.signals

    @property
    def low(self) -> float:
        """The lower control limit, three sigma under the centre.

        The limit is not below what the quantity can be.
        """
        return max(self.least, self.centre - 3.0 * self.sigma)

    @property
    def high(self) -> float:
        """The upper control limit, three sigma above the centre."""
        return self.centre + 3.0 * self.sigma

    @property
    def mean_range(self) -> float:
        """The centre line of the moving ranges."""
        return float(self.ranges.mean())

    @property
    def range_high(self) -> float:
        """The upper control limit of the moving ranges."""
        return D4 * self.mean_range


def control_chart(values: Float64, least: float = -math.inf) -> ControlChart | None:
    """Return the chart of values (n) in order of time, None of fewer than eight.

    Shewhart's individuals and moving range, with the first three of Nelson's tests (Journal of Quality Technology 16,
    1984): a value beyond three sigma, nine on one side of the centre, six steadily rising or falling. Values that do
    not scatter have no signals; rounding counts as no difference.
    """
    if len(values) < FEWEST:
        return None
    ranges = np.abs(without_rounding(np.diff(values), values))
    centre, sigma = float(values.mean()), float(ranges.mean()) / D2
    departures = without_rounding(values - centre, values) / sigma if sigma > 0.0 else np.zeros(len(values))
    return ControlChart(values, ranges, centre, sigma, nelson_signals(values, centre, sigma), shifts(departures), least)


def nelson_signals(values: Float64, centre: float, sigma: float) -> dict[int, str]:
    """Return the places of values (n) that one of three rules signals, with why."""
    signals: dict[int, str] = {}
    if sigma == 0.0:
        return signals
    reach = 3.0 * sigma
    side = steady = 0
    departures = without_rounding(values - centre, values)
    sides = np.sign(departures).astype(int).tolist()
    steps = np.sign(without_rounding(np.diff(values, prepend=values[:1]), values)).astype(int).tolist()
    for index, (above, step) in enumerate(zip(sides, steps, strict=True)):
        side = above if above == 0 or side * above < 0 else side + above
        steady = step if step == 0 or steady * step < 0 else steady + step
        if abs(departures[index]) > reach:
            signals[index] = "beyond the limits"
        elif abs(side) >= _SIDE:
            signals[index] = f"{abs(side)} in a row on one side of the centre"
        elif abs(steady) >= _STEADY - 1:  # six values are five steps
            signals[index] = f"{abs(steady) + 1} in a row {'rising' if steady > 0 else 'falling'}"
    return signals
