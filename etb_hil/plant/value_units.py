"""The units of the equations' values, of rotary and linear devices.

A throttle and a rotary drive have the same.
"""

from __future__ import annotations

from etb_hil.base.quantity import unit_of
from etb_hil.plant.table_one import KINDS

_STATED_AS = {"back_emf": "back_emf_constant", "torque_per_ampere": "torque_constant", "inertia": "throttle_inertia"}
_LINEAR = {
    "N·m": "N",
    "rad": "m",
    "rad/s": "m/s",
    "kg·m²": "kg",
    "N·m/rad": "N/m",
    "N·m·s/rad": "N·s/m",
    "N·m/A": "N/A",
    "V·s/rad": "V·s/m",
}


def value_unit(name: str, *, is_linear: bool) -> str:
    """Return the SI unit of a value of `ThrottleParameters`."""
    unit = unit_of(KINDS[_STATED_AS.get(name, name)].dimension)
    return _LINEAR.get(unit, unit) if is_linear else unit
