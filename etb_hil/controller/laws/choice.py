"""The laws there are: to add one, write its file with `gains` and `torque`, and name it twice here."""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.errors import InputError, Problem
from etb_hil.controller.laws import pd, pid, sliding_mode
from etb_hil.controller.laws.interface import GAINS
from etb_hil.plant.physics import Vector
from etb_hil.plant.values import ThrottleParameters

LAWS = {"pd": pd, "pid": pid, "sliding-mode": sliding_mode}
_PD, _PID = 0, 1


def law_number(name: str) -> int:
    """Return the number by which compiled code calls a law; InputError names the laws there are."""
    if name not in LAWS:
        raise InputError(Problem("no such control law", value=name, allowed=", ".join(LAWS)))
    return list(LAWS).index(name)


def law_gains(name: str, nominal: ThrottleParameters) -> Vector:
    """Return a law's gains (float64, `GAINS`) for the plant that the controller believes to drive."""
    gains = np.zeros(GAINS)
    designed = LAWS[name].gains(nominal)
    gains[: len(designed)] = designed
    return gains


@njit(cache=True, error_model="numpy")
def law_torque(law: int, gain: Vector, memory: Vector, error: float, rate: float) -> float:
    """Return a law's torque in N·m at the throttle shaft for an angle error in rad and a velocity error in rad/s."""
    if law == _PD:
        return pd.torque(gain, memory, error, rate)
    if law == _PID:
        return pid.torque(gain, memory, error, rate)
    return sliding_mode.torque(gain, memory, error, rate)
