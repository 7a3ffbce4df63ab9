"""The throttle's parameters as the equations take them: SI, at the throttle shaft."""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

FAR_ABOVE = 2.15  # times omega_s, where the Gaussian of eq. (2) of the seed paper has fallen to 1 %


@dataclass(frozen=True, slots=True)
class ThrottleParameters:
    """Every value of the base model, at the throttle shaft, in SI.

    Source: seed paper, eq. 1 and 2.
    """

    resistance: float
    inductance: float
    back_emf: float  # K_e G_r
    torque_per_ampere: float  # K_t G_r
    gear_ratio: float
    inertia: float  # J_th + G_r^2 J_m
    preload_open: float
    preload_close: float
    slope_open: float
    slope_close: float
    limp_home: float
    dead_zone: float  # half its width
    stop_low: float
    stop_high: float
    stop_stiffness: float
    stop_damping: float
    coulomb: float  # T_c
    stiction: float  # T_st
    stribeck_velocity: float  # omega_s
    bristle_stiffness: float  # sigma_0
    bristle_damping: float  # sigma_1
    viscous: float  # sigma_2, table I's B
    supply_voltage: float
    voltage_limit: float

    def vector(self) -> NDArray[np.float64]:
        """Return the values as float64 (24), in the order of `plant.physics`.

        Its indices name them.
        """
        return np.array(astuple(self))

    @property
    def return_margin(self) -> float:
        """Torque in N·m by which the weaker spring's preload exceeds break-away.

        Below zero the plate may stay where it is.
        """
        return min(self.preload_open, self.preload_close) - self.stiction
