"""Where the plate of a moving motor stands when play or twist come between the two."""

import math

import numpy as np

from generator import layout as at
from generator.compiled import compiled
from generator.driveline import coupling_torque
from generator.springs import spring_torque, stop_torque

_HALVINGS = 30


def follow(rows, inputs, p, e, rate):
    """By how much the plate lags the motor (rad), and springs and stops load it less for that (N·m), row by row.

    The coupling carries what the plate asks for at rest in it; the plate's inertia swings with the motor.
    """
    out = np.empty((2, len(rows)))
    _follow(rows, inputs, out, 1.0 / rate, p, e)
    return out


@compiled()
def _follow(rows, inputs, out, dt, p, e):
    for k in range(rows.shape[0]):
        now = inputs[min(inputs.shape[0] - 1, int(k * dt * 1000.0 + 1e-6))]
        angle, velocity = rows[k, at.LOG_ANGLE], rows[k, at.LOG_VELOCITY]
        swing = p[at.J_PLATE] * rows[k, at.LOG_ACCELERATION]
        rigid = _held(angle, velocity, now, p, e)
        side = math.copysign(1.0, rigid + swing)
        low, high = 0.0, 1e-4
        while side * coupling_torque(side * high, 0.0, e) < abs(rigid + swing):
            high *= 2.0
        for _ in range(_HALVINGS):  # the coupling's torque grows with the lag, the load falls: halving finds it
            lag = 0.5 * (low + high)
            load = _held(angle - side * lag, velocity, now, p, e) + swing
            if side * coupling_torque(side * lag, 0.0, e) < side * load:
                low = lag
            else:
                high = lag
        out[0, k] = side * low
        out[1, k] = rigid - _held(angle - side * low, velocity, now, p, e)


@compiled()
def _held(plate, velocity, inputs, p, e):
    """Torque of springs and stops on the plate, N·m."""
    return spring_torque(plate, inputs, p, e) + stop_torque(plate, velocity, p, e)
