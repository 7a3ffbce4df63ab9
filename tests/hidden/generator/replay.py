"""Torque and voltage that the plant needs along a given motion: the generator's balances, effect by effect."""

import math

import numpy as np

from generator import layout as at
from generator.compiled import compiled
from generator.friction import extra_drag, move_contact, steady_friction, viscous_coefficient
from generator.motor import back_emf, motor_torque, terminal_voltage, voltage_drop, warm
from generator.springs import spring_torque, stop_torque


def shortfall(rows, inputs, p, e, rate):
    """Torque that is left to accelerate (N·m) and voltage that is left to raise the current (V), row by row."""
    out = np.empty((2, len(rows)))
    slow = np.array([1.0, 0.0, inputs[0, at.IN_TEMPERATURE], inputs[0, at.IN_TEMPERATURE]])
    _shortfall(rows, inputs, slow, out, 1.0 / rate, p, e)
    return out


@compiled()
def _shortfall(rows, inputs, slow, out, dt, p, e):
    z = 0.0
    for k in range(rows.shape[0]):
        now = inputs[min(inputs.shape[0] - 1, int(k * dt * 1000.0 + 1e-6))]
        angle, velocity, current = rows[k, at.LOG_ANGLE], rows[k, at.LOG_VELOCITY], rows[k, at.LOG_CURRENT]
        load = spring_torque(angle, now, p, e) + stop_torque(angle, velocity, p, e)
        g = steady_friction(angle, velocity, load, slow, now, p, e)
        before = z
        if k > 0:
            way = angle - rows[k - 1, at.LOG_ANGLE]
            rest = math.copysign(g / p[at.SIGMA0], way)
            z = rest + (z - rest) * math.exp(-p[at.SIGMA0] * abs(way) / g)
            move_contact(slow, way / dt, dt, e)
            warm(slow, current, now[at.IN_TEMPERATURE], dt, p, e)
        drag = p[at.SIGMA0] * z + p[at.SIGMA1] * (z - before) / dt + viscous_coefficient(now, p, e) * velocity
        drag += extra_drag(velocity, slow, e)
        drive = motor_torque(angle, current, slow, p, e) + e[at.VIBRATION, at.STRENGTH] * now[at.IN_VIBRATION]
        acceleration = rows[k, at.LOG_ACCELERATION]
        if e[at.ECCENTRIC_INERTIA, at.STRENGTH] != 0.0:
            row = e[at.ECCENTRIC_INERTIA]
            inertia = p[at.N] * p[at.N] * p[at.J_MOTOR] + p[at.J_PLATE]
            phase = row[at.A] * angle + row[at.B]
            turning = 0.5 * row[at.A] * math.sin(phase) * velocity * velocity - math.cos(phase) * acceleration
            drive += inertia * row[at.STRENGTH] * turning
        out[0, k] = drive - drag - load
        terminal, _ = terminal_voltage(rows[k, at.LOG_COMMAND], current, k * dt, e)
        if rows[k, at.LOG_MODE] == at.BRIDGE_OFF:
            # The terminals follow the motor: no voltage is missing.
            out[1, k] = 0.0
        else:
            out[1, k] = terminal - voltage_drop(angle, current, slow, p, e) - back_emf(angle, velocity, slow, p, e)
