"""Trouble codes of a throttle body, and measurements they are held against.

The codes are those of SAE J2012; the conditions under which the virtual controller sets them stand in
`etb_hil/controller/monitors.py`. The documents' table is made from this file.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

_SYSTEMS = "PCBU"
_CODE = re.compile(f"([{_SYSTEMS}])([0-3])([0-9A-Fa-f]{{3}})")


@dataclass(frozen=True, slots=True)
class CodeMeaning:
    """What a code says, and the ids of measurements for or against it."""

    text: str
    measurements: tuple[str, ...] = ()


CODES: dict[str, CodeMeaning] = {
    "P2101": CodeMeaning(
        "actuator control motor, range/performance: the plate is not where it was sent",
        ("T_st", "T_c", "step_settling"),
    ),
    "P2102": CodeMeaning("actuator control motor, circuit low: hardly any current", ("winding_resistance",)),
    "P2111": CodeMeaning("throttle actuator stuck open", ("T_st", "return_time_open", "spring_torque_open")),
    "P2112": CodeMeaning("throttle actuator stuck closed", ("T_st", "return_time_closed", "spring_torque_close")),
    "P2118": CodeMeaning("actuator control motor current, range/performance", ("holding_current", "T_c", "T_st")),
    "P2119": CodeMeaning(
        "throttle body, range/performance: the plate does not come back to its default position",
        ("T_st", "spring_torque_open", "spring_torque_close", "default_position"),
    ),
    "P2135": CodeMeaning("plate sensor, tracks A and B disagree", ("plate_sensor_deviation",)),
    "P2176": CodeMeaning("idle position not learnt: the stops were not found", ("default_position",)),
    "P1683": CodeMeaning("default position out of its range", ("default_position", "return_margin")),
}


def code_of_number(number: int) -> str:
    """Return a trouble code's name (SAE J2012) of the upper two of its three bytes.

    0x2119 is P2119.
    """
    return f"{_SYSTEMS[number >> 14 & 3]}{number >> 12 & 3:X}{number & 0xFFF:03X}"


def number_of_code(code: str) -> int:
    """Return the two bytes of a trouble code's name; ValueError where it is none."""
    found = _CODE.fullmatch(code)
    if found is None:
        raise ValueError(f"must be a trouble code, such as P2119 (got '{code}')")
    system, group, number = found.groups()
    return _SYSTEMS.index(system) << 14 | int(group) << 12 | int(number, 16)
