"""The plant with effects: the base integrator with parameters set each tick.

Parameters and load are set anew every 50 us.
"""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.plant.effects import backlash_contact, ports, sensing
from etb_hil.plant.effects.layout import ELASTIC, PLATE_INERTIA, SLOW
from etb_hil.plant.integrator import CURRENT, OMEGA, STATES, THETA, TICK, advance_bristles
from etb_hil.plant.physics import (
    BACK_EMF,
    BRISTLE_STIFFNESS,
    COULOMB,
    GEAR_RATIO,
    INERTIA,
    PARAMETERS,
    RESISTANCE,
    STICTION,
    TORQUE_PER_AMPERE,
    VISCOUS,
    Vector,
    spring_torque,
    stop_torque,
    stribeck,
)

PLATE = STATES
SWING = STATES + 1
SLOW_STATES = STATES + 2
EXTENDED_STATES = SLOW_STATES + SLOW
SENSED_STATES = EXTENDED_STATES + sensing.SENSING


def new_extended_state(theta: float, temperature: float, p: Vector) -> Vector:
    """Return the state of a throttle at rest at an angle in rad.

    The state is float64 (`EXTENDED_STATES`); the throttle has long been at a temperature.
    """
    state = np.zeros(EXTENDED_STATES)
    state[THETA] = state[PLATE] = theta
    state[SLOW_STATES:] = ports.slow_start(temperature, p)
    return state


def new_sensed_state(theta: float, temperature: float, p: Vector) -> Vector:
    """Return an extended state with the memory of sensors behind it.

    Only sensors that tell other than what is have one.
    """
    state = new_extended_state(theta, temperature, p)
    return np.concatenate([state, sensing.new_sensing(theta)]) if sensing.is_there(p) else state


@njit(cache=True, error_model="numpy")
def advance_extended(state: Vector, p: Vector, voltage: float, ticks: int, temperature: float) -> None:
    """Move an extended state in place by whole ticks under a constant voltage.

    The voltage is in V; NaN is an open bridge.

    `p` is the extended vector, `temperature` the housing's in degC. What an effect changes is set at the start of a
    tick and held over it; additional torques come as a kick to the velocity. A state of `SENSED_STATES` has sensors
    behind it that remember.
    """
    if not ports.has_effects(p):
        advance_bristles(state[:STATES], p, p[ELASTIC], voltage, ticks)
        state[PLATE] = state[THETA]
        return
    base = p[:PARAMETERS].copy()
    slow = state[SLOW_STATES:EXTENDED_STATES]
    loose = ports.is_loose(p)
    is_open = np.isnan(voltage)
    command = 0.0 if is_open else voltage
    for _ in range(ticks):
        theta, omega, current = state[THETA], state[OMEGA], state[CURRENT]
        ports.pass_time(slow, omega, omega * TICK, current, command, temperature, TICK, p)
        plate, swing = theta, state[SWING]
        if loose:
            plate = backlash_contact.on_plate(theta, state[PLATE], omega, state[SWING], p)
        elastic = ports.elastic_torque(plate, omega, p)
        g = ports.friction_level(theta, omega, elastic + swing, temperature, p[BRISTLE_STIFFNESS] * state[2], slow, p)
        ratio = g / stribeck(omega, p)
        base[COULOMB], base[STICTION] = ratio * p[COULOMB], ratio * p[STICTION]
        base[VISCOUS] = ports.viscosity(omega, temperature, p)
        base[TORQUE_PER_AMPERE] = p[TORQUE_PER_AMPERE] * (1.0 + ports.torque_share(theta, slow, p))
        base[BACK_EMF] = p[BACK_EMF] * (1.0 + ports.back_emf_share(theta, slow, p))
        base[RESISTANCE] = p[RESISTANCE] * (1.0 + ports.resistance_share(current, slow, p))
        extra = elastic - spring_torque(theta, p) - stop_torque(theta, omega, p)
        extra += ports.motor_drag(theta, omega, slow, p)
        state[OMEGA] = omega - TICK * extra / p[INERTIA]
        u = voltage - ports.voltage_loss(current, command, is_open, slow, p)
        advance_bristles(state[:STATES], base, p[ELASTIC], u, 1)
        if loose:
            # The plate's inertia swings with the motor's acceleration, smoothed over a millisecond against the kicks.
            now = p[PLATE_INERTIA] * (state[OMEGA] - omega) / TICK
            state[SWING] += 0.05 * (now - state[SWING])
        state[PLATE] = plate
        if len(state) > EXTENDED_STATES:
            sensing.pass_tick(state[EXTENDED_STATES:], plate if loose else state[THETA], state[CURRENT], p)
    if not loose:
        state[PLATE] = state[THETA]


@njit(cache=True, error_model="numpy")
def told_current(state: Vector, temperature: float, p: Vector) -> float:
    """Return what the current sensor is given in A.

    The quantity is the current, unless an effect of the sensor changes it.
    """
    return sensing.current(state[EXTENDED_STATES:], temperature, p) if len(state) > EXTENDED_STATES else state[CURRENT]


@njit(cache=True, error_model="numpy")
def told_motor_angle(state: Vector, p: Vector) -> float:
    """Return what the encoder is given in rad.

    The quantity is the motor's angle, unless its disc is off centre.
    """
    angle = state[THETA] * p[GEAR_RATIO]
    return sensing.motor_angle(angle, p) if len(state) > EXTENDED_STATES else angle


@njit(cache=True, error_model="numpy")
def told_plate(state: Vector, p: Vector) -> float:
    """Return what the plate sensor is given in rad.

    The quantity is the motor's own angle, unless an effect lets the teeth give way.
    """
    if len(state) > EXTENDED_STATES:
        return sensing.plate(state[EXTENDED_STATES:], p)
    return state[PLATE] if len(state) > STATES else state[THETA]
