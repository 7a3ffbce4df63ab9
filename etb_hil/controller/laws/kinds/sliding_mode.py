"""Sliding-mode law with a boundary layer (Slotine and Li 1991, section 7.2)."""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.controller.laws.interface import ControlLaw
from etb_hil.plant.physics import Vector
from etb_hil.plant.values import ThrottleParameters

SLOPE = 90.0  # 1/s; errors on the sliding surface die with this rate
LAYER = 1.2  # rad/s; inside it the law is linear, which keeps the 1 ms tick from chattering


def gains(nominal: ThrottleParameters) -> Vector:
    """Return the surface's slope, the inertia, the reaching torque and 1 / layer.

    They are in 1/s, kg·m², N·m and s/rad.

    The reaching torque covers what the feed-forward may have wrong: a preload on the wrong side of limp-home.
    """
    reach = nominal.preload_open + nominal.preload_close
    return np.array([SLOPE, nominal.inertia, reach, 1.0 / LAYER])


@njit(cache=True, error_model="numpy")
def torque(gain: Vector, memory: Vector, error: float, rate: float) -> float:  # noqa: ARG001 (every law's signature)
    """Return the torque in N·m for errors of angle in rad and velocity in rad/s."""
    surface = rate + gain[0] * error
    reaching = min(max(surface * gain[3], -1.0), 1.0)
    return gain[1] * gain[0] * rate + gain[2] * reaching


LAW = ControlLaw("sliding mode with a boundary layer", gains, torque)
