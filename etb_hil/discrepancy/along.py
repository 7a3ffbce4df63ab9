"""The model's torque and voltage along a measured motion, compiled: only bristles and slow states are integrated."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etb_hil.plant.effects import ports, teeth
from etb_hil.plant.effects.layout import PLATE_INERTIA
from etb_hil.plant.physics import (
    BACK_EMF,
    BRISTLE_DAMPING,
    BRISTLE_STIFFNESS,
    RESISTANCE,
    TORQUE_PER_AMPERE,
    VISCOUS,
    VOLTAGE_LIMIT,
    Vector,
    spring_torque,
    stop_torque,
)

_SETTLE = 0.02  # s in which the smoothing of the record's start would move the bristles


@njit(cache=True, error_model="numpy")
def along(
    angle: Vector,
    velocity: Vector,
    acceleration: Vector,
    current: Vector,
    is_open: NDArray[np.bool_],
    temperature: Vector,
    dt: float,
    p: Vector,
    torque: Vector,
    voltage: Vector,
    plate: Vector,
) -> tuple[bool, bool]:
    """Fill driving less passive torque (N·m), the voltage but for L di/dt and K_e G_r omega (V), and the plate (rad).

    All columns are (n) at the throttle shaft, `p` is the extended vector. The torque lacks the inertia's share. The
    bristles follow the way covered exactly (seed paper, eq. 2, solved over the way). Return whether the voltage is
    more than the resistance's, and whether the plate is elsewhere than the motor.
    """
    slow = ports.slow_start(temperature[0])
    friction_acts, elastic_acts, drag_acts, constant_acts, voltage_acts, slow_acts = ports.acting(p)
    loose = ports.is_loose(p)
    friction_acts, elastic_acts = friction_acts or loose, elastic_acts or loose
    bristle = 0.0
    friction = 0.0
    lost = 0.0
    drag = 0.0
    settle = int(_SETTLE / dt)
    resistance, torque_per_ampere, back_emf = p[RESISTANCE], p[TORQUE_PER_AMPERE], p[BACK_EMF]
    limit = p[VOLTAGE_LIMIT]
    sigma_0, sigma_1, sigma_2 = p[BRISTLE_STIFFNESS], p[BRISTLE_DAMPING], p[VISCOUS]
    where = angle[0]
    for k in range(angle.size):
        theta, omega, i = angle[k], velocity[k], current[k]
        way = theta - angle[k - 1] if k > settle else 0.0
        # What the balance itself says of the voltage: losses that scale the measured one would scale its noise away.
        command = 0.0 if is_open[k] else resistance * i + back_emf * omega + lost
        command = min(max(command, -limit), limit)  # no bridge gives more; losses that grow with it would run away
        if slow_acts:
            ports.pass_time(slow, omega, way, i, command, temperature[k], dt, p)
        swing = p[PLATE_INERTIA] * acceleration[k]
        where = teeth.on_plate(theta, where + theta - angle[max(k - 1, 0)], omega, swing, p) if loose else theta
        if elastic_acts:
            elastic = ports.elastic_torque(where, omega, p)
        else:
            elastic = spring_torque(where, p) + stop_torque(where, omega, p)
        if friction_acts:
            g = ports.friction_level(theta, omega, elastic + swing, temperature[k], slow[ports.AGE], friction, p)
            sigma_2 = ports.viscosity(omega, temperature[k], p)
        else:
            g = ports.plain_friction_level(omega, p)
        before = bristle
        if way != 0.0:
            end = math.copysign(g / sigma_0, way)
            bristle = end + (bristle - end) * math.exp(-sigma_0 * abs(way) / g)
        friction = sigma_0 * bristle
        if drag_acts:
            drag = ports.motor_drag(theta, omega, slow[ports.MEMORY], p)
        # The bristles' rate between two rows is told to both of them: it is centred, then.
        rate = 0.5 * sigma_1 * (bristle - before) / dt
        if k > 0:
            torque[k - 1] -= rate
        passive = friction + rate + sigma_2 * omega + elastic + drag
        drive, voltage[k] = torque_per_ampere * i, resistance * i
        if constant_acts:
            drive = torque_per_ampere * (1.0 + ports.torque_share(theta, slow[ports.MAGNET], p)) * i
        torque[k] = drive - passive
        if voltage_acts or constant_acts:
            lost = ports.voltage_loss(i, command, slow[ports.DRAWN], is_open[k], p)
            voltage[k] = (
                resistance * (1.0 + ports.resistance_share(temperature[k], slow[ports.RISE], p)) * i
                + lost
                + back_emf * ports.back_emf_share(theta, slow[ports.MAGNET], p) * omega
            )
        plate[k] = where
    return voltage_acts or constant_acts, loose
