"""Laws that limits follow.

A limit may follow the housing's temperature, and the time of rest before a break-away.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from etb_hil.base.quantity import Duration, Ratio, Temperature, TemperatureCoefficient
from etb_hil.base.yamlfile import FileModel

DECADE = 2.302585092994046  # ln(10)


class TemperatureLaw(FileModel):
    """How a limit follows the housing's temperature.

    The limit does so linearly about a reference, within the range that the law was found in.
    """

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
    """How a limit of break-away follows the time of rest before it.

    The limit does so with the logarithm of that time (Dieterich 1979).
    """

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
        return 1.0 + self.per_decade * float(log(inside / self.reference)) / DECADE
