"""A throttle driven by a voltage that was recorded, or thought up: the plant alone, without sensors or controller."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etb_hil.base.errors import InputError, Problem
from etb_hil.plant.extended import PLATE, advance_extended, new_extended_state
from etb_hil.plant.integrator import CURRENT, OMEGA, TICK_NS
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import PARAMETERS, Vector

Float64 = NDArray[np.float64]
PRESSED = 0.1  # rad, no stop gives way farther
LONGEST_S = 3600.0  # a day at 20 kHz would not fit into a table anyhow


@dataclass(frozen=True, slots=True)
class VoltageRun:
    """What the throttle did, at the instants of the voltage (n): plate angle rad, its velocity rad/s, current A."""

    angle: Float64
    velocity: Float64
    current: Float64


def run_voltage(
    model: Model, time_ns: NDArray[np.int64], voltage: Float64, start_angle: float, temperature: float
) -> VoltageRun:
    """Run a model from rest at an angle in rad, in a housing at a temperature in degC.

    `time_ns` int64 (n) rises strictly; `voltage` (n) in V holds from its instant to the next one, to a tick of 50 us.
    Raises InputError where a voltage is missing, the angle lies beyond a stop, or the run is longer than an hour.
    """
    low, high = model.values.stop_low, model.values.stop_high
    if not low - PRESSED <= start_angle <= high + PRESSED:
        inside, shown = f"{np.degrees(low):.4g} to {np.degrees(high):.4g} deg", f"{np.degrees(start_angle):.4g} deg"
        raise InputError(Problem("the start angle lies beyond the model's stops", value=shown, allowed=inside))
    if not np.isfinite(voltage).all():
        at = float((time_ns[np.argmin(np.isfinite(voltage))] - time_ns[0]) * 1e-9)
        raise InputError(
            Problem("the voltage has a value missing", value=f"{at:g} s after its start", remedy="fill or cut the gap")
        )
    if (length := float((time_ns[-1] - time_ns[0]) * 1e-9)) > LONGEST_S:
        raise InputError(Problem("the voltage is too long", value=f"{length:g} s", allowed=f"up to {LONGEST_S:g} s"))
    tick = np.round((time_ns - time_ns[0]) / TICK_NS).astype(np.int64)
    p = model.vector()
    p[:PARAMETERS] = model.values_at(temperature).vector()
    found = np.empty((len(voltage), 3))
    _run(new_extended_state(start_angle, temperature, p), p, tick, voltage, temperature, found)
    return VoltageRun(found[:, 0].copy(), found[:, 1].copy(), found[:, 2].copy())


@njit(cache=True, error_model="numpy")
def _run(
    state: Vector,
    p: Vector,
    tick: NDArray[np.int64],
    voltage: Vector,
    temperature: float,
    found: Float64,
) -> None:
    for k in range(len(voltage)):
        found[k, 0], found[k, 1], found[k, 2] = state[PLATE], state[OMEGA], state[CURRENT]
        if k + 1 < len(voltage):
            advance_extended(state, p, voltage[k], tick[k + 1] - tick[k], temperature)
