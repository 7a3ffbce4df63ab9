"""The set-ups of the seed paper's section IV.

A position loop at 1 kHz runs around a plant that is kept at 20 kHz.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.stock import stock_file
from etb_hil.controller.laws.kinds import pd
from etb_hil.plant.integrator import BRISTLE, CURRENT, OMEGA, STATES, THETA, TICK, advance_record, new_state
from etb_hil.plant.parameters import ThrottleParameters, load_model
from etb_hil.recording.samples import Float64, Int64

CONTROL_TICKS = 20  # the controller at 1 kHz, everything else at 20 kHz (seed paper, IV.1 and IV.2)
SETTLING_S = 0.3  # left out of every number: the plate comes to rest under control, the estimator finds its way

MID_STROKE = 0.742  # rad
AMPLITUDE = 0.57  # rad: 17.1 rad/s at 30 rad/s, just beyond 2.15 omega_s
ANGULAR_FREQUENCY = 30.0  # rad/s (IV.6)
STEPS = tuple(np.radians([20.0, 60.0, 30.0, 70.0, 12.0, 40.0]).tolist())
HOLD_S = 0.6

Reference = Callable[[Float64], tuple[Float64, Float64]]


@dataclass(frozen=True, slots=True)
class Motion:
    """What happened at 20 kHz, columns (n).

    `reference` and `angle` are in rad, `velocity` in rad/s, `bristle` in rad.
    """

    throttle: ThrottleParameters
    time: Float64  # s
    reference: Float64
    angle: Float64
    velocity: Float64
    bristle: Float64
    current: Float64  # A
    voltage: Float64  # V
    friction: Float64  # N·m

    @property
    def time_ns(self) -> Int64:
        """The instants in whole nanoseconds."""
        return np.round(self.time * 1e9).astype(np.int64)

    @property
    def counted(self) -> NDArray[np.bool_]:
        """Which samples (n) count."""
        return self.time >= SETTLING_S


def healthy() -> ThrottleParameters:
    """Return the default plant.

    Its friction is T_st = 0.0095 N·m, T_c = 0.008 N·m (IV.3), at the throttle shaft.
    """
    return load_model(stock_file("model", "default")).values


def faulty() -> ThrottleParameters:
    """Return the same with T_st = 0.0315 N·m, as IV.4 is read."""
    return load_model(stock_file("model", "faulty")).values


def stribeck_friction(velocity: Float64, throttle: ThrottleParameters) -> Float64:
    """Return g(omega) in N·m at velocities (n) in rad/s; seed paper, eq. (2)."""
    drop = throttle.stiction - throttle.coulomb
    return throttle.coulomb + drop * np.exp(-((velocity / throttle.stribeck_velocity) ** 2))


def friction_torque(velocity: Float64, bristle: Float64, throttle: ThrottleParameters) -> Float64:
    """Return the friction torque (n) in N·m; seed paper, eq. (2)."""
    t = throttle
    rate = velocity - t.bristle_stiffness * np.abs(velocity) / stribeck_friction(velocity, t) * bristle
    return t.bristle_stiffness * bristle + t.bristle_damping * rate + t.viscous * velocity


def sinusoid(amplitude: float = AMPLITUDE, angular_frequency: float = ANGULAR_FREQUENCY) -> Reference:
    """Return the first reference at instants (n) in s.

    The reference is position and velocity of a sine about mid-stroke.
    """

    def at(time: Float64) -> tuple[Float64, Float64]:
        phase = angular_frequency * time
        return MID_STROKE + amplitude * np.sin(phase), amplitude * angular_frequency * np.cos(phase)

    return at


def steps(time: Float64) -> tuple[Float64, Float64]:
    """Return the second reference at instants (n) in s.

    The reference is position (n) and velocity (n) of steps.
    """
    index = np.minimum((time / HOLD_S).astype(int), len(STEPS) - 1)
    return np.array(STEPS)[index], np.zeros(len(time))


def controlled(
    throttle: ThrottleParameters, reference: Reference, duration: float, nominal: ThrottleParameters | None = None
) -> Motion:
    """Run a throttle under PD with static feed-forward (IV).

    Fed forward are Coulomb and viscous friction of the healthy throttle.

    Angle and velocity are measured without error, as the paper assumes. `nominal` is what gains and feed-forward are
    made from.
    """
    known = healthy() if nominal is None else nominal
    gain, memory = pd.gains(known), np.zeros(1)
    control_time: Float64 = np.arange(round(duration / (CONTROL_TICKS * TICK)), dtype=np.float64) * CONTROL_TICKS * TICK
    position, velocity = reference(control_time)
    to_volt = known.resistance / known.torque_per_ampere
    forward = known.coulomb * np.sign(velocity) + known.viscous * velocity
    forward = forward * to_volt + known.back_emf * velocity
    state, p = new_state(float(position[0])), throttle.vector()
    record, voltage = np.empty((len(position) * CONTROL_TICKS, STATES)), np.empty(len(position))
    for k in range(len(position)):
        torque = pd.torque(gain, memory, position[k] - state[THETA], velocity[k] - state[OMEGA])
        wanted = float(forward[k]) + to_volt * torque
        voltage[k] = min(max(wanted, -throttle.voltage_limit), throttle.voltage_limit)
        part = record[k * CONTROL_TICKS : (k + 1) * CONTROL_TICKS]
        advance_record(state, p, voltage[k : k + 1], CONTROL_TICKS, part)
    return _motion(throttle, np.repeat(position, CONTROL_TICKS), np.repeat(voltage, CONTROL_TICKS), record)


def driven(throttle: ThrottleParameters, voltage: Float64, start: float) -> Motion:
    """Run a throttle from rest at `start` in rad under a voltage (n) in V at 20 kHz."""
    state, record = new_state(start), np.empty((len(voltage), STATES))
    advance_record(state, throttle.vector(), voltage, 1, record)
    return _motion(throttle, np.full(len(voltage), np.nan), voltage, record)


def literal_fault() -> ThrottleParameters:
    """Return the faulty throttle as IV.4 prints it.

    Its T_st is 0.00315 N·m at the motor shaft, below T_c.
    """
    t = healthy()
    return replace(t, stiction=0.00315 * t.gear_ratio)


def _motion(throttle: ThrottleParameters, reference: Float64, voltage: Float64, record: Float64) -> Motion:
    columns = [record[:, index].copy() for index in (THETA, OMEGA, BRISTLE, CURRENT)]
    angle, velocity, bristle, current = columns
    time: Float64 = np.arange(1, len(record) + 1, dtype=np.float64) * TICK
    friction = friction_torque(velocity, bristle, throttle)
    return Motion(throttle, time, reference, angle, velocity, bristle, current, voltage, friction)
