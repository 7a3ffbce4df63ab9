"""Base parameters of a model file, and the ranges of the seed paper's table I."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Shaft(StrEnum):
    """The shaft that a rotary value is referred to."""

    MOTOR = "motor"
    THROTTLE = "throttle"


@dataclass(frozen=True, slots=True)
class TableRow:
    """A row of table I: what is common in production, in SI.

    The row is at the shaft that we read it for.
    """

    symbol: str
    definition: str
    low: float = float("-inf")
    high: float = float("inf")
    shaft: Shaft | None = None


@dataclass(frozen=True, slots=True)
class ParameterKind:
    """A parameter: its symbol, its dimension, and its row of table I.

    The parameter says how it is referred from shaft to shaft, too.

    A rotary value at the motor shaft times G_r**`gear_power` is the value at the throttle shaft; None: not rotary.
    `least`: below zero for what is counted from a zero that a sensor sets.
    """

    symbol: str
    dimension: str
    gear_power: int | None = None
    row: TableRow | None = None
    may_be_zero: bool = False
    least: float = 0.0


_MOTOR, _THROTTLE = Shaft.MOTOR, Shaft.THROTTLE

KINDS: dict[str, ParameterKind] = {
    "resistance": ParameterKind("R_a", "resistance", row=TableRow("R_a", "Rotor Resistance", 1.0, 5.0)),
    "inductance": ParameterKind("L", "inductance", row=TableRow("L", "Rotor Inductance", high=3e-3)),
    "back_emf_constant": ParameterKind("K_e", "back-EMF constant", 1, TableRow("K_e", "Back emf", 0.01, 0.08, _MOTOR)),
    "torque_constant": ParameterKind(
        "K_t", "torque constant", 1, TableRow("K_t", "Motor Torque Constant", 0.01, 0.05, _MOTOR)
    ),
    "gear_ratio": ParameterKind("G_r", "ratio", row=TableRow("Gr", "Gear Ratio", 15.0, 22.0)),
    "motor_inertia": ParameterKind("J_m", "inertia", 2, TableRow("J_m", "Rotor Inertia", low=2e-6, shaft=_MOTOR)),
    "throttle_inertia": ParameterKind(
        "J_th", "inertia", 2, TableRow("J_th", "Throttle Inertia", high=50e-6, shaft=_THROTTLE)
    ),
    "preload_open": ParameterKind(
        "T_open", "torque", 1, TableRow("T_open", "Torque at opening", 0.25, 0.45, _THROTTLE)
    ),
    "preload_close": ParameterKind(
        "T_close", "torque", 1, TableRow("T_close", "Torque at closing", 0.3, 0.4, _THROTTLE)
    ),
    "slope_open": ParameterKind("spring slope, opening side", "stiffness", 2, may_be_zero=True),
    "slope_close": ParameterKind("spring slope, closing side", "stiffness", 2, may_be_zero=True),
    "limp_home": ParameterKind("limp-home angle", "angle", -1, may_be_zero=True),
    "dead_zone": ParameterKind("half the dead zone", "angle", -1),
    "stop_low": ParameterKind("lower stop", "angle", -1, may_be_zero=True, least=-0.1),
    "stop_high": ParameterKind("upper stop", "angle", -1),
    "stop_stiffness": ParameterKind("stiffness of the stops", "stiffness", 2),
    "stop_damping": ParameterKind("damping of the stops", "rotary damping", 2, may_be_zero=True),
    # Read at the motor shaft: at the throttle this friction would be lost beside the springs.
    "coulomb": ParameterKind("T_c", "torque", 1, TableRow("T_slip", "Slip Friction Torque", 0.0025, 0.005, _MOTOR)),
    "stiction": ParameterKind("T_st", "torque", 1, TableRow("T_stick", "Stiction Torque", 0.005, 0.03, _MOTOR)),
    "stribeck_velocity": ParameterKind("omega_s", "angular velocity", -1),
    "bristle_stiffness": ParameterKind("sigma_0", "stiffness", 2),
    "bristle_damping": ParameterKind("sigma_1", "rotary damping", 2, may_be_zero=True),
    "viscous": ParameterKind(
        "sigma_2", "rotary damping", 2, TableRow("B", "Viscosity coefficient", low=0.001, shaft=_THROTTLE)
    ),
    "supply_voltage": ParameterKind("supply", "voltage"),
    "voltage_limit": ParameterKind("limit of the motor voltage", "voltage"),
}
