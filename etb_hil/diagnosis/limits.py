"""Limits: what a part may have at most and at least, by the ids of measurements."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from etb_hil.diagnosis.result import Reason
from etb_hil.plant.table_one import Shaft

if TYPE_CHECKING:
    from etb_hil.diagnosis.limit_laws import DwellLaw, TemperatureLaw
    from etb_hil.diagnosis.measurement_kind import MeasurementKind


@dataclass(frozen=True, slots=True)
class Limit:
    """What a measurement may be: at least `low`, at most `high`.

    They are in SI at the shaft that they are stated for, None where there is no limit. `temperature` and `dwell` are
    the laws that it follows; `source` says where it comes from.
    """

    low: float | None = None
    high: float | None = None
    shaft: Shaft = Shaft.THROTTLE
    temperature: TemperatureLaw | None = None
    dwell: DwellLaw | None = None
    source: str = ""

    def at_throttle(self, gear_ratio: float, temperature: float = math.nan) -> tuple[float | None, float | None]:
        """Return the lower and the upper limit at the throttle shaft.

        `temperature` is in degC. Where it is NaN, unknown, the limits are as stated.
        """
        factor = gear_ratio if self.shaft is Shaft.MOTOR else 1.0
        if self.temperature is not None and not math.isnan(temperature):
            factor *= self.temperature.factor(temperature)
        return (
            None if self.low is None else self.low * factor,
            None if self.high is None else self.high * factor,
        )


@dataclass(frozen=True, slots=True)
class Limits:
    """What is allowed of a part: a limit for each measurement that is judged.

    `by_id` has the limits by the id of a measurement or of one of its values. Inside `marginal_band`, a share of each
    limit on either side of it, nothing is decided. `hint` says what to change in a file of an older schema.
    """

    part_number: str
    revision: str
    marginal_band: float
    by_id: Mapping[str, Limit]
    hint: str = ""

    def of(self, kind: MeasurementKind, suffix: str = "") -> Limit | None:
        """Return the limit that applies to a measurement, or None.

        The limit of a single value comes before that of all its values.
        """
        own = self.by_id.get(f"{kind.id}{suffix}") or self.by_id.get(kind.id)
        if own is not None:
            return own
        stated = self.by_id.get(kind.judged_at_rest_by)
        return stated if stated is not None and stated.dwell is not None else None

    @property
    def dwell(self) -> DwellLaw | None:
        """The law of rest that a limit states, or None."""
        return next((limit.dwell for limit in self.by_id.values() if limit.dwell is not None), None)

    def most(self, measurement_id: str, gear_ratio: float, temperature: float = math.nan) -> float | None:
        """Return the upper limit of a measurement in SI at the throttle shaft, or None."""
        return self._at_throttle(measurement_id, gear_ratio, temperature)[1]

    def least(self, measurement_id: str, gear_ratio: float, temperature: float = math.nan) -> float | None:
        """Return the lower limit of a measurement in SI at the throttle shaft, or None."""
        return self._at_throttle(measurement_id, gear_ratio, temperature)[0]

    def _at_throttle(
        self, measurement_id: str, gear_ratio: float, temperature: float
    ) -> tuple[float | None, float | None]:
        limit = self.by_id.get(measurement_id)
        return (None, None) if limit is None else limit.at_throttle(gear_ratio, temperature)


def without_temperature(limits: Limits, temperature: float) -> list[Reason]:
    """Return why limits that follow a temperature cannot be applied without it.

    `temperature` is in degC, NaN where it is not known.
    """
    if not math.isnan(temperature) or all(one.temperature is None for one in limits.by_id.values()):
        return []
    text = "the limits follow the housing's temperature, and none was measured with the current's zero"
    return [Reason("temperature_unknown", text)]
