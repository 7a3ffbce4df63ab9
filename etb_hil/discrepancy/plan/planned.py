"""Simulated records of scenarios that have not been run."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.compiled import njit
from etb_hil.base.modes import Mode
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.rerun import rerun
from etb_hil.discrepancy.fitting.unknowns import simulable
from etb_hil.discrepancy.measured.bridge_opening import without_diodes
from etb_hil.discrepancy.measured.decimation import decimated
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.plant.extended import PLATE, advance_extended, new_extended_state
from etb_hil.plant.integrator import CURRENT, OMEGA, THETA, TICK
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import (
    BACK_EMF,
    COULOMB,
    INERTIA,
    LIMP_HOME,
    RESISTANCE,
    TORQUE_PER_AMPERE,
    VISCOUS,
    VOLTAGE_LIMIT,
    Vector,
    spring_torque,
)
from etb_hil.recording.samples import Float64

_OFF, _VOLTAGE = int(Mode.OFF), int(Mode.VOLTAGE)
PERIOD = 1e-3  # s between two set-points
_BANDWIDTH = 120.0  # rad/s of the PD law
_TURNS = 0.05  # rad/s over which the friction that is fed forward turns its sign
_SEED = 7  # of the sensors' noise


@dataclass(frozen=True, slots=True)
class Plan:
    """A scenario's set-points (n each), one a millisecond.

    `mode` holds the numbers of `base.modes`.
    """

    name: str
    mode: NDArray[np.int64]
    position: Float64
    velocity: Float64
    voltage: Float64


def recorded(plan: Plan, model: Model, like: Balances, p: Vector) -> Measurement:
    """Return a plan's record as balances take it, if parameters `p` were true.

    `p`: extended parameters. The record has the sensors and the rate of `like`; a PD law with static feed-forward of
    the model follows the plan.
    """
    m = like.measured
    samples = np.empty((round(len(plan.mode) * PERIOD * m.rate), 4))
    temperature = float(np.median(m.temperature))
    base = model.vector()
    state = new_extended_state(float(base[LIMP_HOME]), temperature, p)
    _follow(
        state, plan.mode, plan.position, plan.velocity, plan.voltage, base, simulable(p), temperature,
        round(m.dt / TICK), m.dt / PERIOD, samples,
    )  # fmt: skip
    ideal = replace(
        m,
        origin=plan.name,
        start_s=0.0,
        voltage=samples[:, 3].copy(),
        angle=samples[:, 0].copy(),
        current=None if m.current is None else samples[:, 1].copy(),
        plate=None if m.plate is None else samples[:, 2].copy(),
        encoder=None,
        temperature=np.full(len(samples), temperature),
        has_temperature=False,  # a scenario does not change it
        is_good=np.ones(len(samples), np.bool_),
    )
    return decimated(without_diodes(rerun(Balances(ideal, model), p, _SEED), model))


@njit(cache=True, error_model="numpy", nogil=True)
def _follow(
    state: Vector,
    mode: NDArray[np.int64],
    position: Vector,
    velocity: Vector,
    voltage: Vector,
    base: Vector,
    p: Vector,
    temperature: float,
    ticks: int,
    set_points: float,
    samples: Float64,
) -> None:
    """Fill in angle, current, plate angle and voltage; `set_points` pass per sample."""
    volts = base[RESISTANCE] / base[TORQUE_PER_AMPERE]
    stiff = volts * base[INERTIA] * _BANDWIDTH
    limit = base[VOLTAGE_LIMIT]
    for k in range(samples.shape[0]):
        now = min(int(k * set_points + 1e-6), mode.size - 1)
        theta, omega = state[THETA], state[OMEGA]
        if mode[now] == _OFF:
            u = np.nan
        elif mode[now] == _VOLTAGE:
            u = voltage[now]
        else:
            goal, speed = position[now], velocity[now]
            friction = base[COULOMB] * min(max(speed / _TURNS, -1.0), 1.0) + base[VISCOUS] * speed
            u = volts * (spring_torque(goal, base) + friction) + base[BACK_EMF] * speed
            u += _BANDWIDTH * stiff * (goal - theta) + 1.6 * stiff * (speed - omega)
        u = min(max(u, -limit), limit) if not np.isnan(u) else u
        samples[k, 0], samples[k, 1], samples[k, 2] = theta, state[CURRENT], state[PLATE]
        samples[k, 3] = p[BACK_EMF] * omega if np.isnan(u) else u
        advance_extended(state, p, u, ticks, temperature)
