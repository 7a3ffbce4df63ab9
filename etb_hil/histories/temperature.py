"""Take temperature out of friction.

The result says what units would have shown at one temperature, and how sure that is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.reference_temperature import REFERENCE_TEMPERATURE
from etb_hil.histories.tolerance import change_limit
from etb_hil.recording.samples import Float64

REFERENCE = REFERENCE_TEMPERATURE  # degC
LEAST_SPREAD = 5.0  # K between tests of one unit; below, noise passes for temperature
FEWEST = 3  # units: of fewer, one that has changed between its tests passes for temperature
MOST_UNCERTAINTY = 0.025  # share by which a law may leave a value unsure: a tenth of the smallest rise that matters


@dataclass(frozen=True, slots=True)
class TemperatureEffect:
    """How values follow temperature, as a share per K with its 95 % interval.

    `runs` of `units` tell it.
    """

    coefficient: float
    low: float
    high: float
    units: int
    runs: int
    coldest: float
    warmest: float

    def taken_out(self, values: Float64, temperature: Float64) -> Float64:
        """Return values (n) as they would be at 20 degC.

        They are NaN where the law does not carry from their temperature (n) in degC.
        """
        at_reference: Float64 = values * self.factor(temperature)
        return np.where(self.carries(temperature, REFERENCE), at_reference, np.nan)

    def factor(self, temperature: Float64) -> Float64:
        """Return the factor of values at temperature (n) in degC to those at 20 degC."""
        found: Float64 = np.exp(-self.coefficient * (temperature - REFERENCE))
        return found

    def uncertainty(self, distance: Float64 | float) -> Float64:
        """Return the share (n) by which the law is unsure over a distance (n) in K, 95 %."""
        return 0.5 * (self.high - self.low) * np.abs(np.asarray(distance))

    def carries(self, temperature: Float64, to: float) -> NDArray[np.bool_]:
        """Return whether the law carries from temperature (n) in degC to `to`.

        The temperature lies near what the law was seen at, and `to` is not too far.
        """
        seen = (temperature >= self.coldest - LEAST_SPREAD) & (temperature <= self.warmest + LEAST_SPREAD)
        carried: NDArray[np.bool_] = seen & (self.uncertainty(temperature - to) <= MOST_UNCERTAINTY)
        return carried


@dataclass(frozen=True, slots=True)
class UnitLaws:
    """What each unit says by itself that was tested at temperatures 5 K apart.

    Units that have changed are left out.

    `name` (u), `slope` (u) as a share per K, `weight` (u) K^2, `runs` (u), `coldest` and `warmest` (u) degC.
    """

    name: NDArray[np.str_]
    slope: Float64
    weight: Float64
    runs: Float64
    coldest: Float64
    warmest: Float64

    def together(self, without: str | None = None) -> TemperatureEffect | None:
        """Return the law of all units but one, from 3 units on.

        The interval is a jackknife's over units: their laws differ, and one that has changed between its tests tells
        another law than the rest, which no scatter inside units shows.
        """
        kept = np.full(len(self.name), True) if without is None else self.name != without
        count = int(np.count_nonzero(kept))
        if count < FEWEST:
            return None
        from scipy.special import stdtrit  # noqa: PLC0415 (a tenth of a second, which few runs need)

        weight, slope = self.weight[kept], self.slope[kept]
        whole = float(weight.sum())
        middle = float((weight * slope).sum()) / whole
        moved = weight * (slope - middle) / (whole - weight)
        variance = (count - 1) / count * float((moved * moved).sum())
        half = float(stdtrit(count - 1, 0.975)) * variance**0.5
        return TemperatureEffect(
            middle, middle - half, middle + half, count, int(self.runs[kept].sum()), float(self.coldest[kept].min()),
            float(self.warmest[kept].max()),
        )  # fmt: skip


def unit_laws(values: Float64, temperature: Float64, unit: list[str]) -> UnitLaws:
    """Return how values (n) follow temperature (n) in degC inside units.

    Values are above zero. That units differ from each other says nothing.

    Least squares of ln(value) over temperature. A unit that departs from the middle one's law, over its own range, by
    what counts as a rise has changed between its tests: that is no law.
    """
    known = np.isfinite(temperature) & (values > 0.0)
    names, index = np.unique(np.array(unit, dtype=np.str_)[known], return_inverse=True)
    count = np.bincount(index, minlength=len(names)).astype(np.float64)
    warmth, level = temperature[known], np.log(values[known])
    coldest, warmest = np.full(len(names), np.inf), np.full(len(names), -np.inf)
    np.minimum.at(coldest, index, warmth)
    np.maximum.at(warmest, index, warmth)
    apart = warmth - (np.bincount(index, warmth, len(names)) / count)[index]
    weight = np.bincount(index, apart * apart, len(names))
    told = np.flatnonzero(warmest - coldest >= LEAST_SPREAD)
    slope = np.bincount(index, apart * level, len(names))[told] / weight[told]
    departs = (slope - _middle(slope, np.sqrt(weight[told]))) * (warmest - coldest)[told]
    is_typical = np.abs(departs) <= change_limit(departs)
    told, slope = told[is_typical], slope[is_typical]
    return UnitLaws(names[told], slope, weight[told], count[told], coldest[told], warmest[told])


def _middle(values: Float64, weight: Float64) -> float:
    """Return the weighted median of values (n); 0 of none."""
    if not len(values):
        return 0.0
    order = np.argsort(values)
    below = np.cumsum(weight[order])
    return float(values[order[np.searchsorted(below, 0.5 * below[-1])]])
