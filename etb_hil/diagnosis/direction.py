"""Whether angle and current have the same direction: springs give back no more than they hold, and friction nothing.

A plate takes in what the motor's torque does to it along its way. Where current and angle say that it gave out more
than its springs can hold, one of them has the wrong sign.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from etb_hil.diagnosis.result import Reason
from etb_hil.diagnosis.ticks import TICK, Ticks
from etb_hil.plant.parameters import Model, ThrottleParameters
from etb_hil.recording.samples import Float64

_SURE = 1.5  # times what the springs hold by the model: they and the motor's constant may be off
_JITTER = 0.05  # share of a tick by which the distance of two ticks may be off: more means that samples are missing


def against_motor(ticks: Ticks, model: Model, throttle: ThrottleParameters) -> list[Reason]:
    """Return why nothing can be said of friction where the angle moves against the motor's torque.

    Not where voltage and current contradict each other as well: then it is the current that is wrong.
    """
    if len(ticks) < 2:
        return []
    per_ampere, electrical, pieces = _energies(ticks.time, ticks.angle, ticks.current, ticks.voltage)
    work = throttle.torque_per_ampere * per_ampere
    held = _held_by_springs(model, throttle)
    if work >= -_SURE * held * pieces or electrical < 0.0:  # any gap may hide that springs were bent
        return []
    text = (
        f"the angle moves against the motor's torque: by current and angle the plate gave out {-work:.2f} J, and its "
        f"springs hold {held:.2f} J at most: the sign of the angle is reversed"
    )
    if electrical == 0.0:
        text += ", or that of the current (no voltage tells which)"
    step = "check the signs of angle and current in the bench's files, and the sensors' wiring, then repeat"
    return [Reason("angle_reversed", text, step)]


def _held_by_springs(model: Model, throttle: ThrottleParameters) -> float:
    """Return the most that the springs hold between the stops, in J."""
    opened, closed = throttle.stop_high - throttle.limp_home, throttle.limp_home - throttle.stop_low
    return max(
        (throttle.preload_open + model.tolerance("preload_open")) * opened
        + 0.5 * (throttle.slope_open + model.tolerance("slope_open")) * opened * opened,
        (throttle.preload_close + model.tolerance("preload_close")) * closed
        + 0.5 * (throttle.slope_close + model.tolerance("slope_close")) * closed * closed,
    )


@njit(cache=True, error_model="numpy")
def _energies(time: Float64, angle: Float64, current: Float64, voltage: Float64) -> tuple[float, float, int]:
    """Return the integrals of current over angle (A rad) and of electrical power (J), and in how many pieces ticks are.

    The power is 0 where no voltage was measured.
    """
    along = electrical = 0.0
    pieces = 1
    for k in range(1, len(time)):
        if abs(time[k] - time[k - 1] - TICK) > _JITTER * TICK:
            pieces += 1
            continue
        along += 0.5 * (current[k] + current[k - 1]) * (angle[k] - angle[k - 1])
        if np.isfinite(voltage[k]):
            electrical += voltage[k] * current[k] * TICK
    return along, electrical, pieces
