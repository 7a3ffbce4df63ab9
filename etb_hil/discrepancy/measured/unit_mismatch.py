"""Suspected unit mismatches: values that fit the model in another unit."""

from __future__ import annotations

import math

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import spring_torque
from etb_hil.recording.samples import Float64

DEGREES = math.degrees(1.0)  # values in rad whose unit says deg are read this many times too small
TOO_FAR = 1.3  # times the way between the model's stops: a plate presses into them, and a model may be off
_HALF = 0.5  # of the way between the stops
_BLOCK = 0.02  # s: as `winding` averages, over current's lag and the noise of a difference
_SUSPECTED = {
    ("rad", "deg"): (1.0 / DEGREES, "57.3 times too small"),
    ("deg", "rad"): (DEGREES, "57.3 times too large"),
    ("A", "mA"): (1e-3, "1000 times too small"),
    ("mA", "A"): (1e3, "1000 times too large"),
    ("mV", "V"): (1e3, "1000 times too large"),
}


def suspected(values: str, says: str) -> str:
    """Return the sentence about values in one unit whose label says another."""
    _, off = _SUSPECTED[values, says]
    return f"suspected unit mismatch: values in {values} whose unit says {says}, {off}"


def off_by(values: str, says: str) -> float:
    """Return what values in one unit are multiplied by where their label says another."""
    return _SUSPECTED[values, says][0]


def must_be_labelled_in_its_angle(m: Measurement, model: Model) -> None:
    """Refuse an angle in rad whose label says deg.

    With the angle as labelled, the model's voltage has a larger error than the mean voltage; with 57.3 times the angle
    it has a smaller one. The enlarged travel must be that of a test: more than half of the travel between the stops.
    """
    way, between = float(np.ptp(m.angle)), model.values.stop_high - model.values.stop_low
    if not _HALF < DEGREES * way / between <= TOO_FAR:
        return
    if _explained(m, model, 1.0) > 0.0 or _explained(m, model, DEGREES) <= 0.0:
        return
    role = m.role("angle")
    what = f"{m.origin}: the range of {role} is {math.degrees(way):.3g} deg; {suspected('rad', 'deg')}"
    why = "the model explains motor_voltage with 57.3 times this angle, and not with the angle itself"
    raise InputError(Problem(f"{what}: {why}", remedy="correct its unit in the column's header or in the map"))


def _explained(m: Measurement, model: Model, times: float) -> float:
    """Return the share of the voltage's variance that the model explains.

    The motion is so many `times` the measured angle.
    """
    v, p = model.values, tuple(model.values.vector())
    size = max(round(_BLOCK * m.rate), 1)
    angle, voltage = (_means(column, size) for column in (times * m.angle, m.voltage))
    if len(angle) < 3 or not np.var(voltage):  # a second difference needs three
        return 0.0
    step = size * m.dt
    velocity = np.gradient(angle, step)
    inside = np.clip(angle, v.stop_low, v.stop_high)
    springs = np.array([spring_torque(float(one), p) for one in inside])
    torque = v.inertia * np.gradient(velocity, step) + springs + v.coulomb * np.sign(velocity) + v.viscous * velocity
    driven = v.resistance / v.torque_per_ampere * torque + v.back_emf * velocity
    error = voltage - np.clip(driven, -v.voltage_limit, v.voltage_limit)
    return float(1.0 - np.mean(error**2) / np.var(voltage))


def _means(column: Float64, size: int) -> Float64:
    count = len(column) // size
    return column[: count * size].reshape(count, size).mean(axis=1)
