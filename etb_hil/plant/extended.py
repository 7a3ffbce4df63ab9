"""The plant with effects: the base integrator with parameters set each tick.

Parameters and load are set anew every 50 us.
"""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.plant.effects import backlash_contact, ports, sensing
from etb_hil.plant.effects.layout import ELASTIC, PLATE_INERTIA, SLOW
from etb_hil.plant.integrator import BRISTLE, CURRENT, OMEGA, STATES, THETA, TICK, advance_bristles
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
def advance_extended(
    state: Vector, p: Vector, voltage: float, ticks: int, temperature: float, length: float = TICK
) -> None:
    """Move an extended state in place by whole ticks under a constant voltage.

    The voltage is in V; NaN is an open bridge.

    `p` is the extended vector, `temperature` the housing's in degC. What an effect changes is set at the start of a
    tick and held over it; additional torques come as a kick to the velocity. A state of `EXTENDED_STATES` and
    `sensing.SENSING` has sensors behind it that remember, and takes no ticks but of 50 us.
    """
    friction_acts, elastic_acts, drag_acts, constant_acts, voltage_acts, slow_acts = ports.acting(p)
    loose, remembers = ports.is_loose(p), len(state) > EXTENDED_STATES
    acts = friction_acts or elastic_acts or drag_acts or constant_acts or voltage_acts or slow_acts or loose
    if not (acts or remembers):
        advance_bristles(state[:STATES], p, p[ELASTIC], voltage, ticks, length)
        state[PLATE] = state[THETA]
        return
    base = p[:PARAMETERS].copy()
    slow = state[SLOW_STATES:EXTENDED_STATES]
    is_open = np.isnan(voltage)
    command = 0.0 if is_open else voltage
    for _ in range(ticks):
        theta, omega, current = state[THETA], state[OMEGA], state[CURRENT]
        if slow_acts:
            ports.pass_time(slow, omega, omega * length, current, command, temperature, length, p)
        plate, swing = theta, state[SWING]
        if loose:
            plate = backlash_contact.on_plate(theta, state[PLATE], omega, state[SWING], p)
        elastic, extra = 0.0, 0.0
        if friction_acts or elastic_acts or loose:
            elastic = ports.elastic_torque(plate, omega, p)
            extra = elastic - spring_torque(theta, p) - stop_torque(theta, omega, p)
        _set_changed(base, state, elastic + swing, temperature, slow, p, friction_acts, constant_acts, voltage_acts)
        u = voltage - ports.voltage_loss(current, command, is_open, slow, p) if voltage_acts else voltage
        if drag_acts:
            extra += ports.motor_drag(theta, omega, slow, p)
        state[OMEGA] = omega - length * extra / p[INERTIA]
        advance_bristles(state[:STATES], base, p[ELASTIC], u, 1, length)
        if loose:
            # The plate's inertia swings with the motor's acceleration, smoothed over a millisecond against the kicks.
            now = p[PLATE_INERTIA] * (state[OMEGA] - omega) / length
            state[SWING] += 0.05 * (length / TICK) * (now - state[SWING])
        state[PLATE] = plate
        if remembers:
            motor = state[THETA]
            sensing.pass_tick(state[EXTENDED_STATES:], plate if loose else motor, motor, state[CURRENT], p)
    if not loose:
        state[PLATE] = state[THETA]


@njit(cache=True, error_model="numpy", forceinline=True)
def _set_changed(
    base: Vector, state: Vector, load: float, temperature: float, slow: Vector, p: Vector, friction_acts: bool,
    constant_acts: bool, voltage_acts: bool,
) -> None:  # fmt: skip
    """Set the base parameters that effects change at a state, in place."""
    theta, omega = state[THETA], state[OMEGA]
    if friction_acts:
        bristle_torque = p[BRISTLE_STIFFNESS] * state[BRISTLE]
        g = ports.friction_level(theta, omega, load, temperature, bristle_torque, slow, p)
        ratio = g / stribeck(omega, p)
        base[COULOMB], base[STICTION] = ratio * p[COULOMB], ratio * p[STICTION]
        base[VISCOUS] = ports.viscosity(omega, temperature, p)
    if constant_acts:
        base[TORQUE_PER_AMPERE] = p[TORQUE_PER_AMPERE] * (1.0 + ports.torque_share(theta, slow, p))
        base[BACK_EMF] = p[BACK_EMF] * (1.0 + ports.back_emf_share(theta, slow, p))
    if voltage_acts:
        base[RESISTANCE] = p[RESISTANCE] * (1.0 + ports.resistance_share(state[CURRENT], slow, p))


@njit(cache=True, error_model="numpy")
def told_current(state: Vector, temperature: float, p: Vector) -> float:
    """Return what the current sensor is given in A.

    The quantity is the current, unless an effect of the sensor changes it.
    """
    return sensing.current(state[EXTENDED_STATES:], temperature, p) if len(state) > EXTENDED_STATES else state[CURRENT]


@njit(cache=True, error_model="numpy")
def told_motor_angle(state: Vector, p: Vector) -> float:
    """Return what the encoder is given in rad.

    The quantity is the motor's angle, unless its disc is off centre, or the angle arrives late.
    """
    if len(state) > EXTENDED_STATES:
        return sensing.motor_angle(state[EXTENDED_STATES:], p)
    return state[THETA] * p[GEAR_RATIO]


@njit(cache=True, error_model="numpy")
def told_plate(state: Vector, p: Vector) -> float:
    """Return what the plate sensor is given in rad.

    The quantity is the motor's own angle, unless an effect lets the teeth give way.
    """
    if len(state) > EXTENDED_STATES:
        return sensing.plate(state[EXTENDED_STATES:], p)
    return state[PLATE]
