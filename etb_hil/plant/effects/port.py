"""The ports of the plant, where terms of effects enter the equations.

A port says which quantities a term may ask for.
"""

from __future__ import annotations

from enum import Enum

_FRICTION = ("theta", "omega", "load", "bristle_torque", "temperature", "surplus")


class Combine(Enum):
    """How the terms at a port become one number."""

    SUM = "their sum is added"
    PRODUCT = "each term x multiplies by 1 + x"
    CHAIN = "each term takes the value that the one before it gave"
    EXCLUSIVE = "one effect takes the base model's place"


class Port(Enum):
    """A place in the equations: what a term there is, and its unit.

    The port also has quantities, and how several terms combine.

    `asks`: the quantities that a term may take as arguments, beside parameters. `has_states`: it may take its effect's
    states, too. All angles, velocities and torques are at the throttle shaft, in SI; a positive
    torque brakes opening.
    """

    FRICTION_SHARE = ("share added to the friction level g", "1", Combine.SUM, _FRICTION, True)
    FRICTION_TORQUE = ("torque added to the friction level g", "N·m", Combine.SUM, _FRICTION, True)
    FRICTION_AGE = ("torque added to the friction level g by the age of the contacts", "N·m", Combine.SUM, (), True)
    FRICTION_HEAT = ("share by which heat changes all of g", "1", Combine.PRODUCT, ("temperature",), False)
    VISCOUS_SHARE = ("share added to the viscosity", "1", Combine.PRODUCT, ("omega", "temperature"), False)
    STRIBECK_PEAK = ("share of T_st - T_c that is left at a velocity", "1", Combine.EXCLUSIVE, ("omega",), False)
    SPRINGS = ("torque of both springs", "N·m", Combine.EXCLUSIVE, ("theta",), False)
    SPRING_TORQUE = ("torque of the springs beside the model's", "N·m", Combine.SUM, ("theta",), False)
    PLATE_TORQUE = ("torque on the plate", "N·m", Combine.SUM, ("theta", "omega"), False)
    PLATE_LEAD = ("angle by which the motor leads the plate", "rad", Combine.SUM, ("load",), False)
    MOTOR_TORQUE = ("torque on the motor that stores and gives back", "N·m", Combine.SUM, ("theta",), False)
    DRAG_TORQUE = ("torque on the motor that takes energy", "N·m", Combine.SUM, ("theta", "omega"), True)
    TORQUE_SHARE = ("share added to the torque constant", "1", Combine.SUM, ("theta",), True)
    BACK_EMF_SHARE = ("share added to the back-EMF constant", "1", Combine.SUM, ("theta",), True)
    RESISTANCE_SHARE = ("share added to the resistance", "1", Combine.SUM, ("current",), True)
    MOTOR_VOLTAGE = ("voltage lost in the motor", "V", Combine.SUM, ("current",), False)
    BRIDGE_VOLTAGE = ("voltage lost before the motor, bridge on", "V", Combine.SUM, ("current", "command"), True)
    CURRENT_READING = ("current that reaches the sensor", "A", Combine.CHAIN, ("current", "memory"), False)
    CURRENT_SCALE = ("share added to the current's reading", "1", Combine.PRODUCT, ("temperature",), False)
    CURRENT_ZERO = ("current that the sensor reads at none", "A", Combine.SUM, ("temperature",), False)
    CURRENT_LATENESS = ("delay and time constant of the current's reading", "s", Combine.CHAIN, ("lateness",), False)
    MOTOR_SEEN = ("motor angle that reaches the encoder", "rad", Combine.CHAIN, ("theta", "memory"), False)
    MOTOR_LATENESS = ("delay and time constant of the motor angle's reading", "s", Combine.CHAIN, ("lateness",), False)
    ENCODER_ANGLE = ("motor angle that the encoder reads", "rad", Combine.CHAIN, ("angle",), False)
    PLATE_SEEN = ("plate angle that reaches its sensor", "rad", Combine.CHAIN, ("plate", "memory"), False)
    PLATE_LATENESS = ("delay and time constant of the plate angle's reading", "s", Combine.CHAIN, ("lateness",), False)
    PLATE_READING = ("plate angle that its sensor reads", "rad", Combine.CHAIN, ("plate", "memory"), False)

    def __init__(self, says: str, unit: str, combine: Combine, asks: tuple[str, ...], has_states: bool) -> None:
        self.says, self.unit, self.combine, self.asks, self.has_states = says, unit, combine, asks, has_states

    @property
    def is_open(self) -> bool:
        """Whether effects from outside may have terms there."""
        return self.combine is not Combine.EXCLUSIVE and not {"memory", "lateness"} & set(self.asks)

    @property
    def has_memory(self) -> bool:
        """Whether its terms take what a sensor remembers.

        Each such port has a memory of its own.
        """
        return "memory" in self.asks

    @property
    def index(self) -> int:
        """Place of the port among all ports."""
        return list(Port).index(self)


FRICTION = (
    Port.FRICTION_SHARE, Port.FRICTION_TORQUE, Port.FRICTION_AGE, Port.FRICTION_HEAT, Port.VISCOUS_SHARE,
    Port.STRIBECK_PEAK,
)  # fmt: skip
ELASTIC = (Port.SPRINGS, Port.SPRING_TORQUE, Port.PLATE_TORQUE)
DRAG = (Port.MOTOR_TORQUE, Port.DRAG_TORQUE)
MOTOR_CONSTANT = (Port.TORQUE_SHARE, Port.BACK_EMF_SHARE)
VOLTAGE = (Port.MOTOR_VOLTAGE, Port.BRIDGE_VOLTAGE, Port.RESISTANCE_SHARE)
READINGS = (
    Port.CURRENT_READING, Port.CURRENT_SCALE, Port.CURRENT_ZERO, Port.CURRENT_LATENESS, Port.MOTOR_SEEN,
    Port.MOTOR_LATENESS, Port.ENCODER_ANGLE, Port.PLATE_SEEN, Port.PLATE_LATENESS, Port.PLATE_READING,
)  # fmt: skip

# What moves a state from one instant to the next; a friction state knows the motion and the temperature alone.
STATE_ASKS = ("omega", "travel", "current", "command", "temperature", "dt")
FRICTION_STATE_ASKS = ("omega", "travel", "temperature", "dt")
START_ASKS = ("temperature",)
SENSOR_ASKS = ("memory", "travel", "current")
QUANTITIES = frozenset({*STATE_ASKS, *SENSOR_ASKS, *(name for port in Port for name in port.asks)})
