"""Numbers of one unit that were measured at the bench.

They narrow a model's tolerances.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from etb_hil.base.quantity import unit_of
from etb_hil.plant.parameter import Parameter, Tolerance
from etb_hil.plant.table_one import KINDS

# In SI they are one number of one motor: who measures one has measured both.
TIED = {"torque_constant": "back_emf_constant", "back_emf_constant": "torque_constant"}

_CALLED = {"back_emf_constant": "torque_constant", "throttle_inertia": "motor_inertia"}
NEVER = ("gear_ratio", "supply_voltage", "voltage_limit")  # no explanation moves them


@dataclass(frozen=True, slots=True)
class Measured:
    """A measured number in SI, at the shaft of its parameter.

    The true one lies within `uncertainty`.

    `name`: a parameter's, or `<effect>.<strength>`; `stated`: what the model file says without it, within `tolerance`
    (of an effect: 0, within 0).
    """

    name: str
    value: float
    uncertainty: float
    unit: str
    stated: float
    tolerance: float

    @property
    def id(self) -> str:
        """The id of the cause that the number stands for."""
        if self.is_of_effect:
            return self.name.partition(".")[0]
        return f"parameter:{_CALLED.get(self.name, self.name)}"

    def times(self, factor: float) -> Measured:
        """Return the number as it is where its parameter is a factor of what it was."""
        value, stated = self.value * factor, self.stated * factor
        return replace(
            self, value=value, uncertainty=self.uncertainty * factor, stated=stated, tolerance=self.tolerance * factor
        )

    @property
    def is_of_effect(self) -> bool:
        """Whether it is a strength of an effect, and not a base parameter."""
        return "." in self.name

    @property
    def is_off(self) -> bool:
        """Whether the number lies outside what the model file states.

        Such a number is a cause then, whatever its own error.
        """
        return bool(abs(self.value - self.stated) > self.tolerance + self.uncertainty)


def measured_parameter(parameter: Parameter, value: float, uncertainty: float) -> Measured:
    """Return a measured base parameter."""
    unit = unit_of(KINDS[parameter.name].dimension)
    return Measured(parameter.name, value, uncertainty, unit, parameter.value, parameter.half_width)


def with_measured(parameters: Mapping[str, Parameter], measured: Mapping[str, Measured]) -> dict[str, Parameter]:
    """Return parameters with measured ones at their values and uncertainties."""
    found = dict(parameters)
    for name, one in measured.items():
        if one.is_of_effect:
            continue
        known = replace(parameters[name], value=one.value, tolerance=Tolerance(one.uncertainty, is_relative=False))
        found[name] = known
        if (other := TIED.get(name)) is not None:
            share = Tolerance(one.uncertainty / one.value, is_relative=True)
            value = parameters[other].value * one.value / parameters[name].value
            found[other] = replace(parameters[other], value=value, tolerance=share)
    return found
