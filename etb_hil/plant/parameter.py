"""One parameter of a model, and how parameters become values of equations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from etb_hil.plant.table_one import KINDS, Shaft
from etb_hil.plant.values import ThrottleParameters


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far the true value may lie from the stated one.

    The tolerance is a share of it, or an amount in SI.
    """

    amount: float
    is_relative: bool

    def half_width(self, value: float) -> float:
        """Return the tolerance in the value's own unit."""
        return self.amount * abs(value) if self.is_relative else self.amount


@dataclass(frozen=True, slots=True)
class TemperatureLaw:
    """A value that changes linearly: `coefficient` in 1/K about a `reference` in degC."""

    coefficient: float
    reference: float

    def factor(self, temperature: float) -> float:
        """Return what the value is multiplied by at a temperature in degC."""
        return 1.0 + self.coefficient * (temperature - self.reference)


@dataclass(frozen=True, slots=True)
class Parameter:
    """A value in SI at the shaft that it is stated for, with what is known of it."""

    name: str
    value: float
    shaft: Shaft | None
    tolerance: Tolerance
    source: str
    temperature: TemperatureLaw | None = None

    @property
    def half_width(self) -> float:
        """The tolerance in SI, at the parameter's own shaft."""
        return self.tolerance.half_width(self.value)

    def at_shaft(self, shaft: Shaft | None, gear_ratio: float) -> float:
        """Return the value referred to another shaft."""
        power = KINDS[self.name].gear_power
        if power is None or shaft is None or self.shaft is shaft:
            return self.value
        return self.value * gear_ratio ** (power if shaft is Shaft.THROTTLE else -power)


def referred(parameters: Mapping[str, Parameter]) -> ThrottleParameters:
    """Return the values of the equations: everything at the throttle shaft."""
    gear = parameters["gear_ratio"].value
    at = {name: parameter.at_shaft(Shaft.THROTTLE, gear) for name, parameter in parameters.items()}
    at["back_emf"] = at.pop("back_emf_constant")
    at["torque_per_ampere"] = at.pop("torque_constant")
    at["inertia"] = at.pop("motor_inertia") + at.pop("throttle_inertia")
    return ThrottleParameters(**at)
