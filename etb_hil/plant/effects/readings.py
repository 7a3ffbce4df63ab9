"""What sensors make of whole records, and what was there before them.

The terms of all sensors' effects act in turn.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.compiled import njit
from etb_hil.plant.effects import sensing
from etb_hil.plant.effects.catalogue import acting_at, places_at, strengths_at
from etb_hil.plant.effects.compose import called
from etb_hil.plant.effects.port import READINGS, Port
from etb_hil.plant.physics import Vector

_ROUNDS = 6  # of the encoder's inverse: each takes the residual down by the slope of its error


def key(p: Vector) -> bytes:
    """Return what the readings of all sensors depend on."""
    return p[places_at(*READINGS)].tobytes()


def current_scale(temperature: Vector | float, p: Vector) -> Vector | float:
    """Return by which factor the current's reading is too large.

    The temperature is in degC, one or one at every sample.
    """
    found: Vector | float = 1.0
    for effect in acting_at(Port.CURRENT_SCALE):
        for function in effect.at(Port.CURRENT_SCALE):
            found = found * (1.0 + called(effect, function, p, temperature=temperature))
    return found


def current_zero(current: Vector, temperature: Vector, p: Vector, sign: float = 1.0) -> Vector:
    """Return a current (n) in A with the sensor's zero added.

    With a `sign` of -1 it is taken off.
    """
    for effect in acting_at(Port.CURRENT_ZERO):
        for function in effect.at(Port.CURRENT_ZERO):
            current = current + sign * called(effect, function, p, temperature=temperature)
    return current


def measured_current(current: Vector, temperature: Vector, p: Vector) -> Vector:
    """Return what the sensor makes of a current (n) in A that reaches it."""
    return current_zero(current * current_scale(temperature, p), temperature, p)


def true_current(current: Vector, temperature: Vector, p: Vector) -> Vector:
    """Return the current (n) in A behind a measured one, but for its lateness."""
    return current_zero(current, temperature, p, -1.0) / current_scale(temperature, p)


def without_zero(p: Vector) -> Vector:
    """Return parameters with sensors that read no current where there is none."""
    found = p.copy()
    found[strengths_at(Port.CURRENT_ZERO)] = 0.0
    return found


def late_by(port: Port, p: Vector) -> tuple[float, float]:
    """Return the delay and the time constant in s of a reading, by its port."""
    found = 0.0, 0.0
    for effect in acting_at(port):
        for function in effect.at(port):
            found = called(effect, function, p, lateness=found)
    return float(found[0]), float(found[1])


def lateness(port: Port, s: NDArray[np.complex128], p: Vector) -> NDArray[np.complex128] | None:
    """Return a measured signal's spectrum over the true one's.

    The ratio is taken at s = j omega; None where nothing is late. The port is that of the signal's lateness.
    """
    delay, lag = late_by(port, p)
    if delay == 0.0 and lag == 0.0:
        return None
    return np.exp(-s * delay) / (1.0 + s * lag)


def arrived(values: Vector, dt: float, port: Port, p: Vector) -> Vector:
    """Return what arrives of a signal (n), by the port of its lateness.

    It is sampled each dt s, goes straight from sample to sample, and was constant before the first one.
    """
    delay, lag = late_by(port, p)
    if delay != 0.0:
        time = dt * np.arange(len(values))
        values = np.interp(time - delay, time, values)
    if lag > 0.0:  # Franklin, Powell and Workman 1998: the triangle-hold equivalent
        share, ratio = np.exp(-dt / lag), lag / dt
        now, before = 1.0 - ratio * (1.0 - share), ratio * (1.0 - share) - share
        values = _recursion(np.ascontiguousarray(values, np.float64), now, before, share)
    return values


@njit(cache=True, error_model="numpy", nogil=True)
def _recursion(values: Vector, now: float, before: float, kept: float) -> Vector:
    """Return a first-order filter's output (n), from rest at the first value.

    SciPy has one, but only extras bring it, and its import takes a second.
    """
    found = np.empty_like(values)
    found[0] = values[0]
    for k in range(1, values.size):
        found[k] = now * values[k] + before * values[k - 1] + kept * found[k - 1]
    return found


def measured_angle(angle: Vector, p: Vector) -> Vector:
    """Return what the encoder makes of a motor angle (n) in rad, but for its lateness."""
    if p[strengths_at(Port.ENCODER_ANGLE)].any():
        for effect in acting_at(Port.ENCODER_ANGLE):
            for function in effect.at(Port.ENCODER_ANGLE):
                angle = called(effect, function, p, angle=angle)
    return angle


def true_angle(angle: Vector, p: Vector) -> Vector:
    """Return the motor angle in rad behind a measured one (n), but for its lateness."""
    true = angle
    for _ in range(_ROUNDS):  # the error's slope is far below one
        seen = measured_angle(true, p)
        if seen is true:
            break
        true = angle - (seen - true)
    return true


def has_plate_errors(p: Vector) -> bool:
    """Tell whether the plate sensor reads other than what reaches it."""
    return bool(p[strengths_at(Port.PLATE_READING)].any())


def measured_plate(plate: Vector, p: Vector) -> Vector:
    """Return what the sensor makes of a plate angle (n) in rad, but for its lateness."""
    return sensing.plates(plate, p) if has_plate_errors(p) else plate
