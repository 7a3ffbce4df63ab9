"""The laws for compiled code.

Calls of ours are written out from the registry; a plug-in's law is called by its address.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.errors import PartFault
from etb_hil.controller.laws.interface import GAINS
from etb_hil.controller.laws.outside import address_of, called, compiled, gains_of
from etb_hil.controller.laws.registry import LAWS
from etb_hil.plant.physics import Vector
from etb_hil.plant.values import ThrottleParameters

_OWN = LAWS.all_own()


def law_number(name: str) -> int:
    """Return the number by which compiled code calls a law.

    InputError names the laws there are.
    """
    LAWS.require(name)
    return list(_OWN).index(name) if name in _OWN else address_of(LAWS.of_plugins()[name])


def law_gains(name: str, nominal: ThrottleParameters) -> Vector:
    """Return a law's gains (float64, `GAINS`) for the nominal plant."""
    LAWS.require(name)
    gains = np.zeros(GAINS)
    designed = _OWN[name].gains(nominal) if name in _OWN else gains_of(LAWS.of_plugins()[name], nominal)
    gains[: len(designed)] = designed
    return gains


def failed_law(name: str, refused: Vector) -> PartFault:
    """Return the fault of a law that has no finite torque in compiled code.

    `refused` holds its angle error (rad), its velocity error (rad/s) and its torque (N·m).
    """
    error, rate, torque = map(float, refused)
    where = f"at an angle error of {math.degrees(error):.3g} deg and a velocity error of {math.degrees(rate):.3g} deg/s"
    raised = "it raised an exception, or " if math.isnan(torque) else ""
    what = f"{raised}its torque was not finite ({torque} N·m) {where}"
    if name in _OWN:
        return PartFault(f"the control law {name!r}: {what}")
    return PartFault(str(LAWS.of_plugins()[name].refused(what)))


def _written_out() -> Callable[..., Any]:
    """Return a function that calls our law of a number.

    Any other number is the address of a law.
    """
    passed = "gain, memory, error, rate"
    scope: dict[str, Any] = {"called": called}
    lines = [f"def choose(law, {passed}):"]
    for number, law in enumerate(_OWN.values()):
        scope[f"law_{number}"] = compiled(law.torque)
        lines += [f"    if law == {number}:", f"        return law_{number}({passed})"]
    exec("\n".join([*lines, f"    return called(law, {passed})"]), scope)  # noqa: S102 (written here)
    made: Callable[..., Any] = njit(cache=False, error_model="numpy", forceinline=True)(scope["choose"])
    return made


_choose = _written_out()


@njit(cache=True, error_model="numpy")
def law_torque(law: int, gain: Vector, memory: Vector, error: float, rate: float) -> float:
    """Return a law's torque in N·m at the throttle shaft.

    The angle error is in rad, the velocity error in rad/s.

    `law` is what `law_number` gives.
    """
    return _choose(law, gain, memory, error, rate)
