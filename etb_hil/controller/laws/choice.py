"""The laws for compiled code: to add one of ours, write its file with `LAW`, name it in `registry`, call it here."""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.controller.laws import pd, pid, sliding_mode
from etb_hil.controller.laws.interface import GAINS, ControlLaw
from etb_hil.controller.laws.outside import address_of, called, gains_of
from etb_hil.controller.laws.registry import OWN, laws_of_plugins, require_law
from etb_hil.plant.physics import Vector
from etb_hil.plant.values import ThrottleParameters

LAWS: dict[str, ControlLaw] = dict(zip(OWN, (pd.LAW, pid.LAW, sliding_mode.LAW), strict=True))
_PD, _PID, _SLIDING_MODE = range(3)


def law_number(name: str) -> int:
    """Return the number by which compiled code calls a law; InputError names the laws there are."""
    require_law(name)
    return OWN.index(name) if name in LAWS else address_of(laws_of_plugins()[name])


def law_gains(name: str, nominal: ThrottleParameters) -> Vector:
    """Return a law's gains (float64, `GAINS`) for the plant that the controller believes to drive."""
    require_law(name)
    gains = np.zeros(GAINS)
    designed = LAWS[name].gains(nominal) if name in LAWS else gains_of(laws_of_plugins()[name], nominal)
    gains[: len(designed)] = designed
    return gains


@njit(cache=True, error_model="numpy")
def law_torque(law: int, gain: Vector, memory: Vector, error: float, rate: float) -> float:
    """Return a law's torque in N·m at the throttle shaft for an angle error in rad and a velocity error in rad/s.

    A number above those of our laws is the address of a plug-in's law.
    """
    if law == _PD:
        return pd.torque(gain, memory, error, rate)
    if law == _PID:
        return pid.torque(gain, memory, error, rate)
    if law == _SLIDING_MODE:
        return sliding_mode.torque(gain, memory, error, rate)
    return called(law, gain, memory, error, rate)
