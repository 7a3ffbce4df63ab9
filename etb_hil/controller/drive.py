"""From the reference to the bridge's voltage.

The controller feeds forward what it knows, and the law does the rest.
"""

from __future__ import annotations

import math

from etb_hil.base.compiled import njit
from etb_hil.base.modes import Mode
from etb_hil.controller.laws.choice import law_torque
from etb_hil.controller.laws.interface import CUT_OFF
from etb_hil.controller.state import Settings, State
from etb_hil.plant.physics import (
    BACK_EMF,
    COULOMB,
    INERTIA,
    RESISTANCE,
    TORQUE_PER_AMPERE,
    VISCOUS,
    VOLTAGE_LIMIT,
    Vector,
    spring_torque,
)

VOLTAGE = int(Mode.VOLTAGE)
CREEP = 0.02  # rad/s, below it Coulomb's feed-forward fades out, so that a reference at rest asks for none


@njit(cache=True, error_model="numpy")
def feed_forward(s: State, nominal: Vector) -> float:
    """Return the torque in N·m that the nominal plant needs for the reference.

    Source: seed paper, section IV, and eq. 1.

    Coulomb and viscous friction are the paper's; springs and inertia are added so that a fast reference can be met.
    """
    sliding = min(max(s.velocity / CREEP, -1.0), 1.0)
    friction = nominal[COULOMB] * sliding + nominal[VISCOUS] * s.velocity
    return friction + spring_torque(s.position, nominal) + nominal[INERTIA] * s.acceleration


@njit(cache=True, error_model="numpy")
def drive_voltage(s: State, settings: Settings, nominal: Vector) -> float:
    """Return the voltage in V for this control tick; the bridge's limit is kept.

    It is NaN, and the bridge goes off, where the law has no finite torque for finite errors.
    """
    limit = nominal[VOLTAGE_LIMIT]
    if s.mode == VOLTAGE:
        return min(max(s.setpoint_voltage, -limit), limit)
    error = s.position - s.measured_position
    rate = s.velocity - s.measured_velocity
    from_law = law_torque(settings.law, settings.gain, s.law_memory, error, rate)
    if math.isfinite(error + rate) and not math.isfinite(from_law):
        s.law_failed = s.released = 1
        s.law_refused[0], s.law_refused[1], s.law_refused[2] = error, rate, from_law
        return math.nan
    torque = feed_forward(s, nominal) + from_law
    to_volt = nominal[RESISTANCE] / nominal[TORQUE_PER_AMPERE]
    wanted = torque * to_volt + nominal[BACK_EMF] * s.velocity
    given = min(max(wanted, -limit), limit)
    s.law_memory[CUT_OFF] = (wanted - given) / to_volt
    return given
