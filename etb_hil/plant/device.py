"""What a model is of: a throttle, or another machine with one axis."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Driven(StrEnum):
    """What a record says of the drive: the winding's voltage, its current, or a force."""

    VOLTAGE = "voltage"
    CURRENT = "current"
    FORCE = "force"


@dataclass(frozen=True, slots=True)
class Device:
    """The parts that a machine has, and how it is driven and moves.

    A throttle has a plate, a gear, two springs and two stops. `driven`: of a force, a torque too. `is_linear`: it has N
    for N·m, and m for rad.
    """

    is_throttle: bool = True
    driven: Driven = Driven.VOLTAGE
    is_linear: bool = False
    has_spring: bool = True
    has_stops: bool = True

    @property
    def has_winding(self) -> bool:
        """Whether its winding is a part of the model."""
        return self.driven is Driven.VOLTAGE

    @property
    def turns_a_load(self) -> bool:
        """Whether its shaft may turn a load against gravity."""
        return not self.is_throttle and not self.is_linear


THROTTLE = Device()
