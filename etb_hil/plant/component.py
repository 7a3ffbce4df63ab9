"""The component of a device that a cause sits in.

The component has to be looked at, whichever of its laws the cause is.
"""

from __future__ import annotations

from enum import StrEnum

from etb_hil.plant.effects.port import FRICTION, Port


class Component(StrEnum):
    """A component, as an engineer calls it."""

    FRICTION = "friction of bearings, seals and gear"
    SPRINGS = "springs"
    LOAD = "load of the output shaft"
    GEAR = "gear train"
    INERTIA = "moving masses"
    MOTOR = "motor"
    SUPPLY = "supply and bridge"
    CURRENT_SENSOR = "current sensor"
    ANGLE_SENSOR = "angle sensor"


_OF_PORT = {
    **dict.fromkeys((*FRICTION, Port.DRAG_TORQUE), Component.FRICTION),
    **dict.fromkeys((Port.SPRINGS, Port.SPRING_TORQUE), Component.SPRINGS),
    Port.PLATE_TORQUE: Component.LOAD,
    Port.PLATE_LEAD: Component.GEAR,
    **dict.fromkeys((Port.MOTOR_TORQUE, Port.TORQUE_SHARE, Port.BACK_EMF_SHARE), Component.MOTOR),
    **dict.fromkeys((Port.RESISTANCE_SHARE, Port.MOTOR_VOLTAGE), Component.MOTOR),
    Port.BRIDGE_VOLTAGE: Component.SUPPLY,
    **dict.fromkeys((Port.CURRENT_READING, Port.CURRENT_SCALE), Component.CURRENT_SENSOR),
    **dict.fromkeys((Port.CURRENT_ZERO, Port.CURRENT_LATENESS), Component.CURRENT_SENSOR),
    **dict.fromkeys((Port.MOTOR_SEEN, Port.MOTOR_LATENESS, Port.ENCODER_ANGLE), Component.ANGLE_SENSOR),
    **dict.fromkeys((Port.PLATE_SEEN, Port.PLATE_LATENESS, Port.PLATE_READING), Component.ANGLE_SENSOR),
}
_OF_PARAMETER = {
    **dict.fromkeys(("resistance", "inductance", "back_emf_constant", "torque_constant"), Component.MOTOR),
    "gear_ratio": Component.GEAR,
    **dict.fromkeys(("motor_inertia", "throttle_inertia"), Component.INERTIA),
    **dict.fromkeys(("preload_open", "preload_close", "slope_open", "slope_close"), Component.SPRINGS),
    **dict.fromkeys(("limp_home", "dead_zone"), Component.SPRINGS),
    **dict.fromkeys(("stop_low", "stop_high", "stop_stiffness", "stop_damping"), Component.LOAD),
    **dict.fromkeys(("coulomb", "stiction", "stribeck_velocity", "viscous"), Component.FRICTION),
    **dict.fromkeys(("bristle_stiffness", "bristle_damping"), Component.FRICTION),
    **dict.fromkeys(("supply_voltage", "voltage_limit"), Component.SUPPLY),
}


def component_at(port: Port) -> Component:
    """Return the component that acts at a port."""
    return _OF_PORT[port]


def component_of_parameter(name: str) -> Component:
    """Return the component of a base parameter, by its name in a model file."""
    return _OF_PARAMETER[name]
