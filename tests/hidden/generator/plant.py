"""Equations of motion, and one step of the classical Runge-Kutta method.

The stiffest rate of a unit (bristle, winding, teeth in contact) stays below 4e4 1/s: at 20 to 42 us the method is
stable and accurate without any splitting; tests hold it against half the step. An effect that takes nearly all friction
on one side makes the bristle stiffer: there, and at the stops, a step is made of several.
"""

import math

from generator import layout as at
from generator.compiled import compiled
from generator.driveline import coupling_torque
from generator.friction import extra_drag, move_contact, steady_friction, viscous_coefficient
from generator.motor import FREEWHEEL, back_emf, motor_torque, voltage_drop, warm
from generator.springs import spring_torque, stop_torque


@compiled()
def friction(angle, velocity, bristle, load, slow, inputs, p, e):
    """Friction torque, N·m, and rate of the bristle, rad/s (seed paper, eq. 2)."""
    g = steady_friction(angle, velocity, load, slow, inputs, p, e)
    rate = velocity - p[at.SIGMA0] * abs(velocity) / g * bristle
    torque = p[at.SIGMA0] * bristle + p[at.SIGMA1] * rate + viscous_coefficient(inputs, p, e) * velocity
    return torque + extra_drag(velocity, slow, e), rate


@compiled()
def rates(angle, velocity, bristle, current, plate, plate_velocity, voltage, opened, two_mass, slow, inputs, p, e):
    """Rates of velocity, bristle, current and plate velocity (seed paper, eq. 1), and the friction torque.

    `voltage` at the terminals; `opened`: no bridge, the current runs out through the diodes.
    """
    load = spring_torque(plate, inputs, p, e) + stop_torque(plate, plate_velocity, p, e)
    drag, bristle_rate = friction(angle, velocity, bristle, load, slow, inputs, p, e)
    drive = motor_torque(angle, current, slow, p, e) - drag + e[at.VIBRATION, at.STRENGTH] * inputs[at.IN_VIBRATION]
    motor_inertia = p[at.N] * p[at.N] * p[at.J_MOTOR]
    if two_mass:
        passed = coupling_torque(angle - plate, velocity - plate_velocity, e)
        acceleration = (drive - passed) / motor_inertia
        plate_acceleration = (passed - load) / p[at.J_PLATE]
    else:
        inertia = motor_inertia + p[at.J_PLATE]
        if e[at.ECCENTRIC_INERTIA, at.STRENGTH] != 0.0:
            row = e[at.ECCENTRIC_INERTIA]
            phase = row[at.A] * angle + row[at.B]
            drive += 0.5 * inertia * row[at.STRENGTH] * row[at.A] * math.sin(phase) * velocity * velocity
            inertia *= 1.0 + row[at.STRENGTH] * math.cos(phase)
        acceleration = (drive - load) / inertia
        plate_acceleration = acceleration
    if opened:
        current_rate = -current / FREEWHEEL
    else:
        drop = voltage_drop(angle, current, slow, p, e) + back_emf(angle, velocity, slow, p, e)
        current_rate = (voltage - drop) / p[at.L]
    return acceleration, bristle_rate, current_rate, plate_acceleration, drag


@compiled()
def advance(state, slow, voltage, opened, two_mass, dt, inputs, p, e):
    """Move `state` (angle, velocity, bristle, current, plate angle, plate velocity) and `slow` by one step in place."""
    th, w, z, i, pl, v = state
    a1, b1, c1, d1, _ = rates(th, w, z, i, pl, v, voltage, opened, two_mass, slow, inputs, p, e)
    h = 0.5 * dt
    w2, v2 = w + h * a1, v + h * d1
    a2, b2, c2, d2, _ = rates(
        th + h * w, w2, z + h * b1, i + h * c1, pl + h * v, v2, voltage, opened, two_mass, slow, inputs, p, e
    )
    w3, v3 = w + h * a2, v + h * d2
    a3, b3, c3, d3, _ = rates(
        th + h * w2, w3, z + h * b2, i + h * c2, pl + h * v2, v3, voltage, opened, two_mass, slow, inputs, p, e
    )
    w4, v4 = w + dt * a3, v + dt * d3
    a4, b4, c4, d4, _ = rates(
        th + dt * w3, w4, z + dt * b3, i + dt * c3, pl + dt * v3, v4, voltage, opened, two_mass, slow, inputs, p, e
    )
    s = dt / 6.0
    th += s * (w + 2.0 * (w2 + w3) + w4)
    pl += s * (v + 2.0 * (v2 + v3) + v4)
    state = (
        th,
        w + s * (a1 + 2.0 * (a2 + a3) + a4),
        z + s * (b1 + 2.0 * (b2 + b3) + b4),
        i + s * (c1 + 2.0 * (c2 + c3) + c4),
        pl if two_mass else th,
        v + s * (d1 + 2.0 * (d2 + d3) + d4),
    )
    # Contact age and reversal memory live on the distance covered: the step's mean velocity moves them.
    move_contact(slow, s / dt * (w + 2.0 * (w2 + w3) + w4), dt, e)
    warm(slow, 0.5 * (i + state[3]), inputs[at.IN_TEMPERATURE], dt, p, e)
    return state
