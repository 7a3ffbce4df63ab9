"""A check that angle and current have the same direction.

Springs give back no more than they took, and friction gives back nothing.

A plate takes in what the motor's torque does to it along its way. Where current and angle say that it gave out more
than its springs can have held, one of them has the wrong sign.
"""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.diagnosis.result import Reason
from etb_hil.diagnosis.ticks import TICK, Ticks
from etb_hil.plant.parameters import Model, ThrottleParameters
from etb_hil.recording.samples import Float64

_SURE = 1.5  # times what springs and inertia are by the model: they and the motor's constant may be off
_BRIDGED = 5.5 * TICK  # a gap up to here the plate crosses in one sweep: the ends tell the work
_LAG = 3.0  # ticks by which current and angle may be late against each other: in dashes that looks like work
_LEAST = 0.2  # share of what the springs hold: less work than that is sensors' noise about a plate at rest


def against_motor(ticks: Ticks, model: Model, throttle: ThrottleParameters) -> list[Reason]:
    """Return a reason where the angle moves against the motor's torque.

    Then nothing can be said of friction. Where voltage and current contradict each other as well, it is the current
    that is wrong, and there is no such reason.
    """
    if len(ticks) < 2:
        return []
    held, steepest = _springs(model, throttle)
    per_ampere, unsure, given, electrical = _energies(
        ticks.time, ticks.angle, ticks.current, ticks.voltage, held, steepest, throttle.inertia
    )
    work = throttle.torque_per_ampere * per_ampere
    most = _SURE * given + _LEAST * held + throttle.torque_per_ampere * unsure
    if work >= -most or electrical < 0.0:
        return []
    text = (
        f"the angle moves against the motor's torque: by current and angle the plate gave out {-work:.2f} J, where its "
        f"springs, inertia and sensors account for {most:.2f} J at most: the sign of the angle is reversed, "
    )
    text += (
        "or that of the current (no voltage tells which)"
        if electrical == 0.0
        else "or that of both current and voltage (the motor's leads)"
    )
    return [Reason("angle_reversed", text)]


def _springs(model: Model, throttle: ThrottleParameters) -> tuple[float, float]:
    """Return the most that the springs hold, in J, and pull with, in N·m.

    They hold it between the stops.
    """
    held = steepest = 0.0
    for side, way in (
        ("open", throttle.stop_high - throttle.limp_home),
        ("close", throttle.limp_home - throttle.stop_low),
    ):
        preload = getattr(throttle, f"preload_{side}") + model.tolerance(f"preload_{side}")
        bend = (getattr(throttle, f"slope_{side}") + model.tolerance(f"slope_{side}")) * way
        held, steepest = max(held, (preload + 0.5 * bend) * way), max(steepest, preload + bend)
    return held, steepest


@njit(cache=True, error_model="numpy")
def _energies(
    time: Float64, angle: Float64, current: Float64, voltage: Float64, held: float, steepest: float, inertia: float
) -> tuple[float, float, float, float]:
    """Return the motor's work with its error, and the energies to compare it with.

    The work and its error are in A rad. The energies in J are what may be given out, and the electrical energy. Springs
    give out no more than they hold, nor than they pull with along what an angle differs over a gap, or from the first
    one to the last; a plate that is in motion after a gap brings what it has in motion. Along ways that were seen, what
    springs give out they took. The electrical energy is 0 where no voltage was measured.
    """
    last = len(time) - 1
    work = lag = unsure = electrical = 0.0
    given = min(held, steepest * abs(angle[last] - angle[0])) + _in_motion(time, angle, 0, inertia)
    for k in range(1, last + 1):
        passed, step, rise = time[k] - time[k - 1], angle[k] - angle[k - 1], current[k] - current[k - 1]
        if passed > _BRIDGED:
            given += min(held, steepest * abs(step)) + _in_motion(time, angle, k, inertia)
            continue
        work += 0.5 * (current[k] + current[k - 1]) * step
        if passed > 1.5 * TICK:
            unsure += 0.5 * abs(rise * step)  # what a trapezoid may be off by where neither turns round
        else:
            lag += rise * step  # by so much the work changes with a tick more between current and angle
        if np.isfinite(voltage[k]):
            electrical += voltage[k] * current[k] * passed
    return work, unsure + _LAG * abs(lag), given, electrical


@njit(cache=True, error_model="numpy")
def _in_motion(time: Float64, angle: Float64, k: int, inertia: float) -> float:
    """Return the kinetic energy in J at the tick `k`, by the way to the next one."""
    if k + 1 >= len(time):
        return 0.0
    velocity = (angle[k + 1] - angle[k]) / (time[k + 1] - time[k])
    return 0.5 * inertia * velocity * velocity
