"""Limits files: what a part may have at most, by part number and revision."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from etb_hil.base.quantity import Ratio, Temperature, TemperatureCoefficient, Torque
from etb_hil.base.yamlfile import Document, FileModel, load
from etb_hil.plant.table_one import Shaft

Text = Annotated[str, Field(min_length=1, max_length=2000)]


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


class LowerLimit(FileModel):
    """The least that a torque must be, at the shaft it is stated for."""

    min: Torque
    shaft: Shaft
    source: Annotated[Text, Field(description="where the limit comes from; 'chosen' is an honest source")]

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
    stiction: UpperLimit
    coulomb: UpperLimit
    return_margin: LowerLimit
    marginal_band: Annotated[Ratio, Field(ge=0.0, lt=0.5)]


def load_limits(path: Path) -> Document[Limits]:
    """Read a limits file; InputError lists every problem with file, line, key and value."""
    return load(path, Limits)
