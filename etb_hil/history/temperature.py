"""Temperature taken out of friction: what units would have shown at one temperature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from etb_hil.recording.samples import Float64

REFERENCE = 20.0  # degC
LEAST_SPREAD = 5.0  # K within units; below, noise passes for temperature
_FEWEST = 4  # degrees of freedom


@dataclass(frozen=True, slots=True)
class TemperatureEffect:
    """How values follow temperature, as a share per K with its 95 % interval; `units` were seen at several."""

    coefficient: float
    low: float
    high: float
    units: int
    runs: int
    coldest: float
    warmest: float

    def taken_out(self, values: Float64, temperature: Float64) -> Float64:
        """Return values (n) as they would be at 20 degC; NaN where the temperature (n) in degC is unknown."""
        taken: Float64 = values * np.exp(-self.coefficient * (temperature - REFERENCE))
        return taken


def temperature_effect(values: Float64, temperature: Float64, unit: list[str]) -> TemperatureEffect | None:
    """Return how values (n), above zero, follow temperature (n) in degC inside each unit; None where nothing tells.

    Least squares of ln(value) over temperature, with a level of each unit: that one unit was tested warm and another
    one cold says nothing. Told it is where units differ by 5 K from their mean at the least, and 4 degrees of freedom
    are left.
    """
    known = np.isfinite(temperature) & (values > 0.0)
    names, index = np.unique(np.array(unit)[known], return_inverse=True)
    if not len(names):
        return None
    count = np.bincount(index)
    warmth, level = temperature[known], np.log(values[known])
    warmth_apart = warmth - (np.bincount(index, warmth) / count)[index]
    level_apart = level - (np.bincount(index, level) / count)[index]
    freedom = len(level) - len(names) - 1
    spread = float((warmth_apart**2).sum())
    if freedom < _FEWEST or 2.0 * float(np.abs(warmth_apart).max()) < LEAST_SPREAD:
        return None
    slope = float((warmth_apart * level_apart).sum()) / spread
    variance = float(((level_apart - slope * warmth_apart) ** 2).sum()) / freedom
    half = float(student.ppf(0.975, freedom)) * (variance / spread) ** 0.5
    repeated = count[index] > 1
    seen = warmth[repeated]
    return TemperatureEffect(
        slope, slope - half, slope + half, int((count > 1).sum()), int(repeated.sum()), float(seen.min()),
        float(seen.max()),
    )  # fmt: skip
