"""PID law: PD with an integral that stops while the bridge is at its limit."""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.controller.laws.interface import CONTROL_PERIOD, CUT_OFF, ControlLaw
from etb_hil.controller.laws.kinds import pd
from etb_hil.plant.physics import Vector
from etb_hil.plant.values import ThrottleParameters

RESET_TIME = 0.04  # s; far above the closed loop's own 1/180 s, so that the integral does not disturb its damping

_INTEGRAL = 1  # index in memory


def gains(nominal: ThrottleParameters) -> Vector:
    """Return stiffness, damping, the integral's gain and its largest torque.

    The gain is that for one tick, in N·m/rad; the torque is in N·m.

    The integral has to cover what the feed-forward may have wrong, no more: pressed on a stop it must not wind up.
    """
    stiffness, damping = pd.gains(nominal)
    return np.array([stiffness, damping, stiffness * CONTROL_PERIOD / RESET_TIME, nominal.preload_open])


@njit(cache=True, error_model="numpy")
def torque(gain: Vector, memory: Vector, error: float, rate: float) -> float:
    """Return the torque in N·m for errors of angle in rad and velocity in rad/s."""
    if memory[CUT_OFF] * error <= 0.0:
        memory[_INTEGRAL] = min(max(memory[_INTEGRAL] + gain[2] * error, -gain[3]), gain[3])
    return gain[0] * error + gain[1] * rate + memory[_INTEGRAL]


LAW = ControlLaw("PD with an integral that stops while the bridge is at its limit", gains, torque)
