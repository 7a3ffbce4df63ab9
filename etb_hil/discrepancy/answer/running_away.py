"""Where nothing but friction holds the plate: springs and flow give way there, and what noise leaves of a run grows."""

from __future__ import annotations

import numpy as np

from etb_hil.discrepancy.fitting.freerun import SEGMENT_S
from etb_hil.plant.effects import ports
from etb_hil.plant.physics import BACK_EMF, RESISTANCE, STOP_HIGH, STOP_LOW, TORQUE_PER_AMPERE, VISCOUS, Vector

_PLACES = 400


def runs_away(p: Vector) -> tuple[float, float] | None:
    """Return between which angles (rad) a moving plate runs away under a constant voltage, or None.

    There springs and flow close it less the further it is open, by enough to grow e-fold within a free run's segment
    against what damps it: viscosity and the motor's own voltage.
    """
    theta = np.linspace(float(p[STOP_LOW]), float(p[STOP_HIGH]), _PLACES)
    slope = np.diff([ports.elastic_torque(float(angle), 0.0, p) for angle in theta]) / np.diff(theta)
    damping = float(p[TORQUE_PER_AMPERE] * p[BACK_EMF] / p[RESISTANCE] + p[VISCOUS])
    places = np.flatnonzero(-slope * SEGMENT_S > damping)
    return (float(theta[places[0]]), float(theta[places[-1] + 1])) if len(places) else None
