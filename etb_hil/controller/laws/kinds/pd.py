"""PD law, what production throttles use (seed paper, section IV)."""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.controller.laws.interface import ControlLaw
from etb_hil.plant.physics import Vector
from etb_hil.plant.values import ThrottleParameters

BANDWIDTH = 180.0  # rad/s; the motor's electrical lag and the 1 ms tick leave about 45 degrees of phase there
DAMPING = 1.0


def gains(nominal: ThrottleParameters) -> Vector:
    """Return stiffness and damping that place both poles at the bandwidth.

    They are in N·m/rad and N·m·s/rad.
    """
    motor_damping = nominal.torque_per_ampere * nominal.back_emf / nominal.resistance
    stiffness = nominal.inertia * BANDWIDTH**2
    damping = 2.0 * DAMPING * nominal.inertia * BANDWIDTH - motor_damping
    return np.array([stiffness, max(damping, 0.0)])


@njit(cache=True, error_model="numpy")
def torque(gain: Vector, memory: Vector, error: float, rate: float) -> float:  # noqa: ARG001 (every law's signature)
    """Return the torque in N·m for errors of angle in rad and velocity in rad/s."""
    return gain[0] * error + gain[1] * rate


LAW = ControlLaw("PD, what production throttles use", gains, torque)
