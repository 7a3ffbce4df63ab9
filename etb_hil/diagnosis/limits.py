"""Limits files: what a part may have at most, by part number and revision."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.quantity import Duration, Ratio, Temperature, TemperatureCoefficient, Torque, format_quantity
from etb_hil.base.yamlfile import Document, FileModel, load
from etb_hil.diagnosis.result import Reason
from etb_hil.plant.table_one import Shaft

Text = Annotated[str, Field(min_length=1, max_length=2000)]
_DECADE = 2.302585092994046


class TemperatureLaw(FileModel):
    """How a limit follows the housing's temperature: linearly about a reference, within the range it was found in."""

    coefficient: Annotated[TemperatureCoefficient, Field(description="share of the limit per K, as a rule negative")]
    reference: Temperature
    between: Annotated[
        tuple[Temperature, Temperature], Field(description="beyond these, the limit stays as it is there")
    ]

    @model_validator(mode="after")
    def _stays_positive(self) -> TemperatureLaw:
        if self.between[0] >= self.between[1]:
            raise ValueError("the first temperature must lie below the second")
        if min(self.factor(edge) for edge in self.between) <= 0.0:
            raise ValueError("this law takes the limit to zero within its range")
        return self

    def factor(self, temperature: float) -> float:
        """Return what the limit is multiplied by at a temperature in degC."""
        inside = min(max(temperature, self.between[0]), self.between[1])
        return 1.0 + self.coefficient * (inside - self.reference)


class DwellLaw(FileModel):
    """How a limit of break-away follows the time of rest before it: with its logarithm (Dieterich 1979)."""

    per_decade: Annotated[Ratio, Field(description="share of the limit that a ten times longer rest adds")]
    reference: Annotated[Duration, Field(gt=0.0, description="the rest that the limit is stated for")]
    between: Annotated[tuple[Duration, Duration], Field(description="beyond these, the limit stays as it is there")]

    @model_validator(mode="after")
    def _stays_positive(self) -> DwellLaw:
        if not 0.0 < self.between[0] < self.between[1]:
            raise ValueError("two times above zero are expected, the shorter one first")
        if min(self.factor(edge) for edge in self.between) <= 0.0:
            raise ValueError("this law takes the limit to zero within its range")
        return self

    def factor(self, rest: float) -> float:
        """Return what the limit is multiplied by after a rest in s."""
        from etb_hil.plant.exactmath import log  # noqa: PLC0415 (loads numba, which most files need not)

        inside = min(max(rest, self.between[0]), self.between[1])
        return 1.0 + self.per_decade * float(log(inside / self.reference)) / _DECADE


class UpperLimit(FileModel):
    """The most that a friction torque may be, at the shaft it is stated for."""

    max: Torque
    shaft: Shaft
    temperature: Annotated[
        TemperatureLaw | None, Field(description="temperature moves friction more than wear does")
    ] = None
    source: Annotated[Text, Field(description="where the limit comes from; 'chosen' is an honest source")]

    @field_validator("max")
    @classmethod
    def _positive(cls, value: float) -> float:
        if value <= 0.0:
            raise ValueError("a torque above zero is expected")
        return value

    def at_throttle(self, gear_ratio: float, temperature: float = math.nan) -> float:
        """Return the limit in N·m at the throttle shaft; `temperature` in degC, NaN where unknown: then as stated."""
        stated = self.max * gear_ratio if self.shaft is Shaft.MOTOR else self.max
        if self.temperature is None or math.isnan(temperature):
            return stated
        return stated * self.temperature.factor(temperature)


class StictionLimit(UpperLimit):
    """The most that T_st may be; with a law of rest, break-aways are held against it too."""

    dwell: Annotated[
        DwellLaw | None, Field(description="contacts grow while they rest: break-aways are judged by this law")
    ] = None


class LowerLimit(FileModel):
    """The least that a torque must be, at the shaft it is stated for."""

    min: Torque
    shaft: Shaft
    source: Annotated[Text, Field(description="where the limit comes from; 'chosen' is an honest source")]

    @field_validator("min")
    @classmethod
    def _brings_the_plate_back(cls, value: float) -> float:
        if value < 0.0:
            raise ValueError("below zero friction holds the plate against its springs; zero or more is expected")
        return value

    def at_throttle(self, gear_ratio: float) -> float:
        """Return the limit in N·m at the throttle shaft."""
        return self.min * gear_ratio if self.shaft is Shaft.MOTOR else self.min


class Limits(FileModel):
    """What is allowed of a part.

    `stiction` is T_st, `coulomb` T_c, `return_margin` the weaker spring's preload less T_st. Inside `marginal_band`, a
    share of each limit on either side of it, nothing is decided.
    """

    schema_: Annotated[Literal["etb_hil/limits/1"], Field(alias="schema")]
    part_number: Text
    revision: Text
    description: str = ""
    stiction: StictionLimit
    coulomb: UpperLimit
    return_margin: LowerLimit
    marginal_band: Annotated[Ratio, Field(ge=0.0, lt=0.5)]


def without_temperature(limits: Limits, temperature: float) -> list[Reason]:
    """Return why nothing can be held against limits that follow a temperature, in degC, which is NaN: not known."""
    if not math.isnan(temperature) or limits.stiction.temperature is limits.coulomb.temperature is None:
        return []
    text = "the limits follow the housing's temperature, and none was measured with the current's zero"
    step = "give the bench file the role `temperature` and the scenario a current_zero, or limits without a law"
    return [Reason("temperature_unknown", text, step)]


def load_limits(path: Path, gear_ratio: float | None = None) -> Document[Limits]:
    """Read a limits file; InputError lists every problem with file, line, key and value.

    Limits of T_st and T_c that are stated for different shafts can be compared only where `gear_ratio` is known.
    """
    document = load(path, Limits)
    stiction, coulomb = document.content.stiction, document.content.coulomb
    if gear_ratio is None and stiction.shaft is not coulomb.shaft:
        return document
    gear = 1.0 if gear_ratio is None else gear_ratio
    if coulomb.at_throttle(gear) > stiction.at_throttle(gear):
        most = stiction.at_throttle(gear) * coulomb.max / coulomb.at_throttle(gear)
        raise InputError(
            Problem(
                "the limit of T_c lies above that of T_st: no throttle slides harder than it breaks away",
                document.place("coulomb", "max"),
                format_quantity(coulomb.max, "torque"),
                f"up to {format_quantity(most, 'torque')}, the limit of T_st",
                "look whether the two were exchanged, and at their shafts",
            )
        )
    return document
