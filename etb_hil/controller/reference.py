"""Set-points of 100 to 200 Hz become a smooth reference of 1 kHz.

The reference is smooth where the set-points are.

The reference runs one command interval behind: from where it is to the newest set-point, which it reaches when the
next one is due, as a cubic with the set-points' velocities at both ends. Past it, it goes on at that velocity.
"""

from __future__ import annotations

import math

from etb_hil.base.compiled import njit
from etb_hil.base.modes import Mode
from etb_hil.controller.laws.interface import CONTROL_PERIOD
from etb_hil.controller.state import Settings, State
from etb_hil.plant.physics import LIMP_HOME, STOP_HIGH, STOP_LOW, Vector

POSITION = int(Mode.POSITION)
VELOCITY = int(Mode.VELOCITY)

PRESS = 0.03  # rad that a reference may lie beyond a stop: enough to feel it, not to burn the motor
TOUCH_SPEED = 1.2  # rad/s at which a stop may be met
LEAD = 0.03  # rad that the reference of the velocity mode may run ahead of the plate
RETURN_SPEED = 1.0  # rad/s to limp-home
SHORTEST, LONGEST = 1e-3, 25e-3  # s, of a segment


@njit(cache=True, error_model="numpy")
def restart(s: State, now_ns: int) -> None:
    """Put the reference where the plate is and moves.

    The bridge goes on without a jerk then.
    """
    s.position = s.start_position = s.end_position = s.measured_position
    s.velocity = s.start_velocity = s.end_velocity = s.measured_velocity
    s.acceleration = 0.0
    s.segment_ns = now_ns
    s.segment = s.interval


@njit(cache=True, error_model="numpy")
def aim(s: State, stamp_ns: int, position: float, velocity: float) -> None:
    """Start a segment to a set-point in rad and rad/s.

    The segment begins where the reference was when the command came.
    """
    if s.mode == POSITION:
        s.start_position, s.start_velocity, _ = _cubic(s, stamp_ns)
    else:
        s.start_velocity, _ = _line(s, stamp_ns)
    s.end_position, s.end_velocity = position, velocity
    s.segment_ns = stamp_ns
    s.segment = min(max(s.interval, SHORTEST), LONGEST)


@njit(cache=True, error_model="numpy")
def step(s: State, settings: Settings, nominal: Vector, now_ns: int) -> None:
    """Move the reference to the present control tick."""
    if s.mode == POSITION:
        s.position, s.velocity, s.acceleration = _cubic(s, now_ns)
    elif s.mode == VELOCITY:
        s.velocity, s.acceleration = _line(s, now_ns)
        ahead = s.position + s.velocity * CONTROL_PERIOD
        s.position = min(max(ahead, s.measured_position - LEAD), s.measured_position + LEAD)
    else:
        left = nominal[LIMP_HOME] - s.position
        move = min(max(left, -RETURN_SPEED * CONTROL_PERIOD), RETURN_SPEED * CONTROL_PERIOD)
        s.position += move
        s.velocity, s.acceleration = move / CONTROL_PERIOD, 0.0
    s.position = min(max(s.position, nominal[STOP_LOW] - PRESS), nominal[STOP_HIGH] + PRESS)
    _slow_before_stops(s, settings, nominal)


@njit(cache=True, error_model="numpy")
def _cubic(s: State, at_ns: int) -> tuple[float, float, float]:
    """Return position, velocity and acceleration of the present segment at an instant."""
    t = (at_ns - s.segment_ns) * 1e-9
    if t >= s.segment:
        return s.end_position + s.end_velocity * (t - s.segment), s.end_velocity, 0.0
    u = t / s.segment
    way = (s.end_position - s.start_position) / s.segment
    a = s.start_velocity + s.end_velocity - 2.0 * way
    b = 3.0 * way - 2.0 * s.start_velocity - s.end_velocity
    position = s.start_position + s.segment * u * (s.start_velocity + u * (b + u * a))
    return position, s.start_velocity + u * (2.0 * b + 3.0 * u * a), (2.0 * b + 6.0 * u * a) / s.segment


@njit(cache=True, error_model="numpy")
def _line(s: State, at_ns: int) -> tuple[float, float]:
    """Return velocity and acceleration of the present segment at an instant."""
    t = (at_ns - s.segment_ns) * 1e-9
    if t >= s.segment:
        return s.end_velocity, 0.0
    slope = (s.end_velocity - s.start_velocity) / s.segment
    return s.start_velocity + slope * t, slope


@njit(cache=True, error_model="numpy")
def _slow_before_stops(s: State, settings: Settings, nominal: Vector) -> None:
    """Keep the reference's velocity below what can be braked before a stop."""
    floor = TOUCH_SPEED * TOUCH_SPEED
    up = math.sqrt(floor + 2.0 * settings.braking * max(nominal[STOP_HIGH] - s.measured_position, 0.0))
    down = math.sqrt(floor + 2.0 * settings.braking * max(s.measured_position - nominal[STOP_LOW], 0.0))
    if s.velocity > up:
        s.velocity, s.acceleration = up, -settings.braking
    elif s.velocity < -down:
        s.velocity, s.acceleration = -down, settings.braking
