"""A throttle driven by a given voltage: the plant, and sensors without noise.

The voltage was recorded, or made up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.compiled import njit
from etb_hil.base.errors import InputError, Problem
from etb_hil.plant.extended import advance_extended, new_sensed_state, told_current, told_motor_angle, told_plate
from etb_hil.plant.failed_unit import failed_unit
from etb_hil.plant.integrator import OMEGA, TICK_NS
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import PARAMETERS, Vector

Float64 = NDArray[np.float64]
PRESSED = 0.1  # rad, no stop gives way farther
LONGEST_S = 3600.0  # a day at 20 kHz would not fit into a table anyhow
COLDEST, HOTTEST = -60.0, 200.0  # degC of a housing: beyond them a temperature is one in K


@dataclass(frozen=True, slots=True)
class VoltageRun:
    """What the throttle did as its sensors tell it, and the true velocity.

    The record is at the instants of the voltage (n); the velocity is the motor's.

    Plate angle rad, motor angle rad since the start, velocity rad/s at the throttle shaft, current A.
    """

    angle: Float64
    motor_angle: Float64
    velocity: Float64
    current: Float64


def run_voltage(
    model: Model,
    time_ns: NDArray[np.int64],
    voltage: Float64,
    start_angle: float,
    temperature: float | Float64,
) -> VoltageRun:
    """Run a model from rest at an angle in rad.

    The housing's temperature is in degC, one or one at every instant (n).

    `time_ns` int64 (n) rises strictly; `voltage` (n) in V holds from its instant to the next one, to a tick of 50 us.
    Raises InputError where a voltage is missing, the angle lies beyond a stop, the run is longer than an hour, no
    housing has such a temperature, or the model has no finite state.
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
    degrees = np.broadcast_to(np.asarray(temperature, float), voltage.shape).copy()
    _must_be_of_housing(degrees)
    p, per_kelvin = _laws(model, float(degrees[0]))
    state = new_sensed_state(start_angle, float(degrees[0]), p)
    found = np.empty((len(voltage), 4))
    tick = np.round((time_ns - time_ns[0]) / TICK_NS).astype(np.int64)
    _run(state, p, per_kelvin, tick, voltage, degrees, found)
    is_finite = np.isfinite(found).all(axis=1)
    if not is_finite.all():
        raise InputError(str(failed_unit(model, float(found[max(int(np.argmin(is_finite)) - 1, 0), 0]))))
    plate, motor, velocity, current = (found[:, k].copy() for k in range(4))
    return VoltageRun(plate, motor - start_angle * model.values.gear_ratio, velocity, current)


def _must_be_of_housing(degrees: Float64) -> None:
    """Refuse a temperature in K."""
    for one in (float(degrees.min()), float(degrees.max())):
        if not COLDEST < one < HOTTEST:
            allowed = f"{COLDEST:g} to {HOTTEST:g} degC"
            remedy = "check the unit of its column (degC or K)"
            raise InputError(Problem("no housing has this temperature", None, f"{one:.4g} degC", allowed, remedy))


def _laws(model: Model, temperature: float) -> tuple[Vector, Vector]:
    """Return the whole vector at a temperature in degC, and its change a kelvin."""
    p, base = model.vector(), model.values_at(temperature).vector()
    p[:PARAMETERS] = base
    per_kelvin = np.zeros(len(p))
    per_kelvin[:PARAMETERS] = model.values_at(temperature + 1.0).vector() - base
    return p, per_kelvin


@njit(cache=True, error_model="numpy")
def _run(
    state: Vector,
    first: Vector,
    per_kelvin: Vector,
    tick: NDArray[np.int64],
    voltage: Vector,
    degrees: Vector,
    found: Float64,
) -> None:
    p = first.copy()
    for k in range(len(voltage)):
        for place in range(len(p)):
            p[place] = first[place] + (degrees[k] - degrees[0]) * per_kelvin[place]
        found[k, 0], found[k, 1] = told_plate(state, p), told_motor_angle(state, p)
        found[k, 2], found[k, 3] = state[OMEGA], told_current(state, degrees[k], p)
        if k + 1 < len(voltage):
            advance_extended(state, p, voltage[k], tick[k + 1] - tick[k], degrees[k])
