"""A motor that is much warmer than its housing.

Its winding's resistance rises and its magnets weaken, in one proportion.

Resistance and back-EMF of the run together say by how many kelvin; the back-EMF has the torque constant that friction
is measured with, so that friction is judged all the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from etb_hil.base.reference_temperature import REFERENCE_TEMPERATURE
from etb_hil.diagnosis.result import Reason
from etb_hil.diagnosis.voltage_balance import VoltageBalance
from etb_hil.plant.parameters import Model, ThrottleParameters

_HOTTEST = 155.0  # degC, what a winding of the usual class F stands (IEC 60085)
_SURE = 4.0  # standard errors
_LEAST = 0.5  # share of what copper and magnets do at a temperature: where one does less, it is another fault's


@dataclass(frozen=True, slots=True)
class HotMotor:
    """By how many `kelvin` a motor is warmer than its housing.

    From `low` to `high` resistance and back-EMF are both explained. `resistance` and `constant` are the shares by which
    these differ from the model's.
    """

    kelvin: float
    low: float
    high: float
    resistance: float
    constant: float

    def of(self, throttle: ThrottleParameters) -> ThrottleParameters:
        """Return the model's parameters with the resistance of this motor."""
        return replace(throttle, resistance=throttle.resistance * (1.0 + self.resistance))


def hot_motor(
    balance: VoltageBalance,
    model: Model,
    throttle: ThrottleParameters,
    temperature: float,
    allowed: tuple[float, float],
) -> HotMotor | None:
    """Return the motor's excess temperature, by its resistance and back-EMF.

    None where no excess temperature explains both.

    `temperature` degC is the housing's, NaN where unknown; `allowed` are the shares by which resistance and back-EMF of
    a motor at that temperature may differ from the model's.
    """
    base = REFERENCE_TEMPERATURE if math.isnan(temperature) else temperature
    cool, warm = model.values_at(base), model.values_at(base + 1.0)
    copper, magnets = warm.resistance / cool.resistance - 1.0, warm.back_emf / cool.back_emf - 1.0
    resistance, constant = balance.resistance / throttle.resistance - 1.0, balance.back_emf / throttle.back_emf - 1.0
    reach = (
        allowed[0] + _SURE * balance.resistance_error / throttle.resistance,
        allowed[1] + _SURE * balance.back_emf_error / throttle.back_emf,
    )
    rise, fall = copper / reach[0], magnets / reach[1]
    square = rise * rise + fall * fall
    if copper <= 0.0 or magnets >= 0.0 or square <= 0.0:
        return None
    kelvin = (rise * resistance / reach[0] + fall * constant / reach[1]) / square
    low = max((resistance - reach[0]) / copper, (constant + reach[1]) / magnets, 0.0)
    high = min((resistance + reach[0]) / copper, (constant - reach[1]) / magnets, _HOTTEST - base)
    both = resistance >= _LEAST * copper * kelvin and constant <= _LEAST * magnets * kelvin
    if not (both and low <= kelvin <= high and 0.0 < kelvin < _HOTTEST - base):
        return None
    return HotMotor(kelvin, low, high, resistance, constant)


def hot_motor_remarks(found: HotMotor | None) -> list[Reason]:
    """Return what is said of a hot motor, whatever the verdict."""
    if found is None:
        return []
    text = (
        f"motor about {found.kelvin:.0f} K above housing ({found.low:.0f} to {found.high:.0f} K): winding resistance "
        f"{found.resistance:+.1%}, torque constant {found.constant:+.1%}; worn brushes look the same"
    )
    return [Reason("motor_hot", text)]
