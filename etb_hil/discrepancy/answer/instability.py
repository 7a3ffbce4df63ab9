"""Instability of the plate: where springs and flow pull it away from equilibrium."""

from __future__ import annotations

import numpy as np

from etb_hil.discrepancy.fitting.free_run import SEGMENT_S
from etb_hil.plant.device import Device
from etb_hil.plant.effects import ports
from etb_hil.plant.physics import BACK_EMF, RESISTANCE, STOP_HIGH, STOP_LOW, TORQUE_PER_AMPERE, VISCOUS, Vector

_PLACES = 400


def unstable_range(p: Vector, device: Device) -> tuple[float, float] | None:
    """Return the angles (rad) between which a plate is unstable at constant voltage.

    There the closing torque falls with opening, by enough to grow e-fold within a free run's segment against the
    damping by viscosity and back-EMF. None if there is no such range, or the device has no plate.
    """
    if not device.is_throttle:
        return None
    theta = np.linspace(float(p[STOP_LOW]), float(p[STOP_HIGH]), _PLACES)
    slope = np.diff([ports.elastic_torque(float(angle), 0.0, p) for angle in theta]) / np.diff(theta)
    damping = float(p[TORQUE_PER_AMPERE] * p[BACK_EMF] / p[RESISTANCE] + p[VISCOUS])
    places = np.flatnonzero(-slope * SEGMENT_S > damping)
    return (float(theta[places[0]]), float(theta[places[-1] + 1])) if len(places) else None
