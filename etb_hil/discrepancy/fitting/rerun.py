"""Simulation of a record: the model on the motion, read by its sensors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.compiled import njit
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.free_run import ticks_of
from etb_hil.discrepancy.fitting.unknowns import simulable
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.sampling import current_in_samples, until_next
from etb_hil.plant.effects import readings
from etb_hil.plant.effects.port import Port
from etb_hil.plant.extended import PLATE, advance_extended, new_extended_state
from etb_hil.plant.integrator import CURRENT, OMEGA, THETA
from etb_hil.plant.model_file import Sensors
from etb_hil.plant.physics import BACK_EMF, INDUCTANCE, INERTIA, RESISTANCE, TORQUE_PER_AMPERE, VOLTAGE_LIMIT, Vector
from etb_hil.recording.samples import Float64

_BANDWIDTH = 120.0  # rad/s of the weak controller that keeps the model on the measured motion


def rerun(balances: Balances, p: Vector, seed: int) -> Measurement:
    """Return what the sensors would have measured if parameters `p` were true."""
    return read_by_sensors(balances, p, along_the_motion(balances, p), seed)


def read_by_sensors(balances: Balances, p: Vector, motion: Float64, seed: int) -> Measurement:
    """Return what the sensors would have measured of a motion, with noise by a seed.

    `motion`: see `along_the_motion`.
    """
    m, samples = balances.measured, motion.copy()
    p = simulable(p)
    rng = np.random.default_rng(seed)
    sensors = m.sensors
    count = len(m)
    noise = rng.standard_normal((4, count))
    samples[:, 0] += np.gradient(samples[:, 0]) * m.rate * balances.jitter * noise[3]
    voltage = _rounded(samples[:, 3] + sensors.voltage_noise * noise[0], sensors.voltage_step)
    gear = balances.gear
    seen = readings.arrived(samples[:, 0], m.dt, m.lateness_of_angle, p)
    plates = readings.arrived(samples[:, 2], m.dt, Port.PLATE_LATENESS, p)
    plate = None if m.plate is None else _plate(readings.measured_plate(plates, p), sensors, noise[2])
    if m.is_plates:
        angle = _plate(seen, sensors, noise[2])
    else:
        motor = readings.measured_angle(seen * gear, p)
        grid = m.angle_noise * np.sqrt(12.0) * gear
        angle = (np.floor(motor / grid) + 0.5) * grid / gear
    current = None
    if m.current is not None:
        current = readings.measured_current(_late(balances, samples, p), m.temperature, p)
        current = _rounded(current + sensors.current_noise * noise[1], sensors.current_step)
    return replace(m, voltage=voltage, angle=angle, plate=plate, current=current)


def _late(balances: Balances, samples: Float64, p: Vector) -> Float64:
    """Return the current (n) as it is read late, with its bends between samples."""
    spectrum, dt = balances.spectrum, balances.measured.dt
    late = readings.lateness(Port.CURRENT_LATENESS, spectrum.all_s, p)
    if late is None:
        return samples[:, 1]
    driven = spectrum.all_of(until_next(samples[:, 3], balances.is_open))
    bends, read = (
        driven * current_in_samples(spectrum.all_s, dt, p[RESISTANCE], p[INDUCTANCE], *by)
        for by in ((), readings.late_by(Port.CURRENT_LATENESS, p))
    )
    return spectrum.signal(late * (spectrum.all_of(samples[:, 1]) - bends) + read)


def _plate(angle: Float64, sensors: Sensors, noise: Float64) -> Float64:
    step = sensors.plate_range / 2**sensors.plate_bits
    return _rounded(angle + sensors.plate_noise * noise, step)


def _rounded(values: Float64, step: float) -> Float64:
    return np.round(values / step) * step if step > 0.0 else values


def along_the_motion(balances: Balances, p: Vector) -> Float64:
    """Return angle, current, plate angle and voltage (n, 4) of the model on a motion."""
    m = balances.measured
    p = simulable(p)
    angle, velocity = balances.motion(p)
    samples = np.empty((len(m), 4))
    state = new_extended_state(float(angle[0]), float(m.temperature[0]), p)
    stiff = p[RESISTANCE] * p[INERTIA] / p[TORQUE_PER_AMPERE]
    _keep_on(
        state, p, angle, velocity, balances.driving, balances.is_open, m.temperature,
        m.dt, ticks_of(m.dt), _BANDWIDTH**2 * stiff, _BANDWIDTH * stiff, samples,
    )  # fmt: skip
    return samples


@njit(cache=True, error_model="numpy", nogil=True)
def _keep_on(
    state: Vector,
    p: Vector,
    angle: Vector,
    velocity: Vector,
    voltage: Vector,
    is_open: NDArray[np.bool_],
    temperature: Vector,
    dt: float,
    ticks: int,
    gain_p: float,
    gain_d: float,
    samples: Float64,
) -> None:
    limit = p[VOLTAGE_LIMIT]
    for k in range(angle.size):
        u = voltage[k] + gain_p * (angle[k] - state[THETA]) + gain_d * (velocity[k] - state[OMEGA])
        u = min(max(u, -limit), limit)
        samples[k, 0] = state[THETA]
        samples[k, 1] = state[CURRENT]
        samples[k, 2] = state[PLATE]
        samples[k, 3] = u
        if is_open[k]:
            samples[k, 3] = p[BACK_EMF] * state[OMEGA]  # the voltmeter sees the motor
            u = np.nan
        advance_extended(state, p, u, ticks, temperature[k], dt / ticks)
