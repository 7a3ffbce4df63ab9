"""A position law: PD at half the usual bandwidth."""

import numpy as np
from numpy.typing import NDArray

from etb_hil.plugins.laws import ControlLaw, ThrottleParameters

BANDWIDTH = 90.0  # rad/s


def gains(nominal: ThrottleParameters) -> NDArray[np.float64]:
    """Return stiffness in N·m/rad and damping in N·m·s/rad that place both poles at the bandwidth."""
    motor = nominal.torque_per_ampere * nominal.back_emf / nominal.resistance
    return np.array([nominal.inertia * BANDWIDTH**2, max(2.0 * nominal.inertia * BANDWIDTH - motor, 0.0)])


def torque(gain: NDArray[np.float64], memory: NDArray[np.float64], error: float, rate: float) -> float:  # noqa: ARG001
    """Return the torque in N·m at the throttle shaft for an angle error in rad and a velocity error in rad/s."""
    return float(gain[0] * error + gain[1] * rate)


LAW = ControlLaw("PD at half the usual bandwidth", gains, torque)
