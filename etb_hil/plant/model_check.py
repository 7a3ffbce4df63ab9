"""Checks for impossible and for unusual sets of parameters."""

from __future__ import annotations

from collections.abc import Mapping

from etb_hil.base.errors import Problem
from etb_hil.base.quantity import format_quantity, unit_of
from etb_hil.plant.parameter import Parameter
from etb_hil.plant.table_one import KINDS, Shaft


class ParameterRangeWarning(UserWarning):
    """A parameter lies outside the range of table I of the seed paper.

    That is the range of production throttles.
    """


def impossible(parameters: Mapping[str, Parameter]) -> dict[str, Problem]:
    """Return what no throttle can be, by the name of the parameter to change.

    The problems have no place yet.
    """
    found = {}
    for name, parameter in parameters.items():
        kind = KINDS[name]
        if parameter.value < kind.least or (parameter.value == 0.0 and not kind.may_be_zero):
            found[name] = Problem(
                f"{kind.symbol} is impossible",
                value=format_quantity(parameter.value, kind.dimension),
                allowed=f"{f'{kind.least:g} or more' if kind.may_be_zero else 'above 0'}, in {unit_of(kind.dimension)}",
            )
    if found:
        return found
    gear = parameters["gear_ratio"].value

    def at_throttle(name: str) -> float:
        return parameters[name].at_shaft(Shaft.THROTTLE, gear)

    def shown(name: str) -> str:
        return format_quantity(at_throttle(name), KINDS[name].dimension)

    if at_throttle("stiction") < at_throttle("coulomb"):
        found["stiction"] = Problem(
            "T_st is below T_c: break-away friction cannot be less than sliding friction in the LuGre model (eq. 2)",
            value=f"{shown('stiction')} at the throttle shaft",
            allowed=f"at least T_c, {shown('coulomb')} at the throttle shaft",
            remedy="check the value and its shaft (the seed paper's faulty 0.00315 N·m is read as 0.0315 N·m)",
        )
    if at_throttle("limp_home") - at_throttle("dead_zone") <= at_throttle("stop_low"):
        found["limp_home"] = Problem(
            "the dead zone about limp-home reaches the lower stop",
            value=shown("limp_home"),
            allowed=f"more than {shown('dead_zone')} above {shown('stop_low')}",
        )
    if at_throttle("limp_home") + at_throttle("dead_zone") >= at_throttle("stop_high"):
        found["stop_high"] = Problem(
            "the dead zone about limp-home reaches the upper stop",
            value=shown("stop_high"),
            allowed=f"more than {shown('dead_zone')} above {shown('limp_home')}",
        )
    if at_throttle("voltage_limit") > at_throttle("supply_voltage"):
        found["voltage_limit"] = Problem(
            "the bridge cannot give more than its supply",
            value=shown("voltage_limit"),
            allowed=f"up to {shown('supply_voltage')}",
        )
    return found


def motor_constants_differ(parameters: Mapping[str, Parameter]) -> Problem | None:
    """Return a problem where K_e and K_t differ by more than their tolerances.

    They are one number in SI.
    """
    gear = parameters["gear_ratio"].value
    torque, back_emf = parameters["torque_constant"], parameters["back_emf_constant"]
    k_t, k_e = torque.at_shaft(Shaft.MOTOR, gear), back_emf.at_shaft(Shaft.MOTOR, gear)
    allowed = torque.half_width * k_t / torque.value + back_emf.half_width * k_e / back_emf.value
    if abs(k_t - k_e) <= allowed:
        return None
    return Problem(
        "K_e differs from K_t by more than their tolerances: in SI they are one number for one motor",
        value=f"{k_e:.6g} V·s/rad",
        allowed=f"{k_t:.6g} +- {allowed:.2g} V·s/rad at the motor shaft",
        remedy="check units and shafts, or state the tolerances that you know",
    )


def motor_laws_differ(parameters: Mapping[str, Parameter]) -> Problem | None:
    """Return a problem where K_e and K_t have different laws over temperature.

    They are one number in SI.
    """
    torque, back_emf = (parameters[name].temperature for name in ("torque_constant", "back_emf_constant"))
    if torque == back_emf:
        return None
    said = "none" if back_emf is None else f"{100.0 * back_emf.coefficient:g} %/K about {back_emf.reference:g} degC"
    its = "none" if torque is None else f"{100.0 * torque.coefficient:g} %/K about {torque.reference:g} degC"
    return Problem(
        "K_e's law over the temperature is not K_t's: in SI they are one number for one motor",
        value=said,
        allowed=its,
        remedy="state the same 'temperature' for both",
    )


def outside_table_one(parameter: Parameter, gear_ratio: float) -> str | None:
    """Return a sentence on the row of table I that a parameter lies outside of."""
    kind = KINDS[parameter.name]
    row = kind.row
    if row is None:
        return None
    value = parameter.at_shaft(row.shaft, gear_ratio)
    slack = 1e-9 * abs(value)  # a bound that was converted or referred may come back one bit off
    if row.low - slack <= value <= row.high + slack:
        return None
    unit = "" if unit_of(kind.dimension) == "1" else f" {unit_of(kind.dimension)}"
    span = f"{row.low:g} to {row.high:g}{unit}"
    if row.low == float("-inf"):
        span = f"up to {row.high:g}{unit}"
    if row.high == float("inf"):
        span = f"at least {row.low:g}{unit}"
    shaft = f" at the {row.shaft} shaft" if row.shaft else ""
    return f"{kind.symbol} = {value:.6g}{unit}{shaft} is outside table I, row {row.symbol} ({row.definition}): {span}"
