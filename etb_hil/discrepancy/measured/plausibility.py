"""Plausibility of voltage, angles and temperature: units, columns and signs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.errors import InputError, Problem
from etb_hil.discrepancy.measured.data_sheet import voltage_rms
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.unit_mismatch import DEGREES, must_be_labelled_in_its_angle, off_by, suspected
from etb_hil.plant.model_file import Sensors
from etb_hil.plant.parameters import Model

Float64 = NDArray[np.float64]

_HARDLY = 30.0  # times less than the supply: halfway to a thousand
_SUPPLIES = 2.0  # times the supply's voltage: a charged battery and diodes come to 1.3
_MOST = 0.999  # of the samples: beyond it are spikes
_STILL = 10.0  # times the voltmeter's noise, from the least to the most of a voltage that stands
_MIDDLE = 0.5  # of the way, through which it goes
_TO_AND_FRO = 3  # times
_COLDEST, _HOTTEST = -60.0, 200.0  # degC of a housing
_TELLING = 0.1  # rad of standard deviation, of either; below it play and the plate's sensor may show anything
_STANDS = 1e-3  # of the other
_AS_FAR = 1.25  # times: what is off by more is no sensor's error
_TOGETHER = 0.9  # of a correlation
_AGAINST = 1.0 / 3.0  # of what the back-EMF takes: K_e may be off


def must_be_of_throttle(segments: Sequence[Measurement], model: Model) -> None:
    """Refuse an implausible voltage or temperature, and angles of different motions."""
    if driven := [m for m in segments if not m.is_drive]:
        voltage, angle = (np.concatenate([getattr(m, name) for m in driven]) for name in ("voltage", "angle"))
        must_be_driven(driven[0].origin, voltage, angle, model.sensors)
    for m in segments:
        if not m.is_drive:
            _must_be_of_supply(m, model)
            _must_be_of_housing(m)
            _must_go_together(m, model)
            _must_go_with_the_voltage(m, model)
            must_be_labelled_in_its_angle(m, model)


def must_be_driven(origin: str, voltage: Float64, angle: Float64, sensors: Sensors) -> None:
    """Refuse a constant voltage (n, V) while an angle (n, rad) moves to and fro.

    Under a constant voltage a plate goes to its equilibrium and stays; a ramp in one direction may have one voltage,
    too.
    """
    if not stands(voltage, sensors):
        return
    place = (angle - angle.min()) / max(float(np.ptp(angle)), 1e-12) - 0.5
    ends = np.sign(place[np.abs(place) > 0.5 * _MIDDLE])
    if np.count_nonzero(np.diff(ends)) < _TO_AND_FRO:
        return
    volts = float(np.median(voltage))
    what = f"{origin}: the motor's voltage stands at {volts:.3g} V throughout while its angle goes to and fro"
    remedy = "look at the column of motor_voltage or motor_duty, and at the map: is it the one that drives the motor?"
    raise InputError(Problem(what, remedy=remedy))


def stands(voltage: Float64, sensors: Sensors) -> bool:
    """Tell whether a voltage (n, V) is constant, spikes and noise excepted."""
    low, high = np.quantile(voltage, [1.0 - _MOST, _MOST]).tolist()
    return bool(high - low <= _STILL * voltage_rms(sensors))


def _must_be_of_supply(m: Measurement, model: Model) -> None:
    """Refuse a voltage far above the model's supply: mV or a duty in per cent."""
    volts, supply = float(np.quantile(np.abs(m.voltage), _MOST)), model.values.supply_voltage
    if volts > _SUPPLIES * supply:
        what = f"{m.origin}: the motor's voltage goes up to {volts:.3g} V, where the model's supply has {supply:.3g} V"
        if supply / _HARDLY < volts / off_by("mV", "V") <= _SUPPLIES * supply:
            what += f"; {suspected('mV', 'V')}"
        remedy = "look at its unit (V or mV), at a duty that is in per cent, and at the model's supply_voltage"
        raise InputError(Problem(what, remedy=remedy))


def _must_be_of_housing(m: Measurement) -> None:
    """Refuse a temperature in K."""
    middle = float(np.median(m.temperature))
    if not _COLDEST < middle < _HOTTEST:
        what = f"{m.origin}: the temperature is {middle:.3g} degC, which no housing has"
        remedy = "look at its unit (degC or K), or leave the column out"
        raise InputError(Problem(what, remedy=remedy))


def _must_go_together(m: Measurement, model: Model) -> None:
    """Refuse angles of motor and plate that are not one motion through the gear."""
    motor, plate = m.motor_and_plate
    if plate is None:
        return
    motor, plate = motor[m.is_good], plate[m.is_good]
    far = float(np.std(motor)), float(np.std(plate))
    if max(far) < _TELLING:
        return
    gear = f"over the gear ratio of {model.values.gear_ratio:.4g}"
    if min(far) < _STANDS * max(far):
        still, moves = ("throttle_angle", "motor_angle") if far[1] < far[0] else ("motor_angle", "throttle_angle")
        what, remedy = f"{still} stands still while {moves} moves", "look at its sensor, or leave the column out"
    elif not 1.0 / _AS_FAR < far[1] / far[0] < _AS_FAR:
        what = f"throttle_angle goes {far[1] / far[0]:.3g} times as far as motor_angle {gear}"
        times = far[1] / far[0] / DEGREES, far[0] / far[1] / DEGREES
        if any(1.0 / _AS_FAR < one < _AS_FAR for one in times):
            what += "; suspected unit mismatch: the larger one holds deg, or the smaller one rad, against its label"
        remedy = (
            "check their units (rad or deg), the order of the columns and the model's gear_ratio; check "
            "whether an encoder starts anew each turn or a sensor stands still for a time"
        )
    elif (together := float(np.corrcoef(motor, plate)[0, 1])) < -_TOGETHER:
        what, remedy = "throttle_angle goes against motor_angle", "turn the sign of the one that falls when it opens"
    elif together < _TOGETHER:
        what = f"throttle_angle does not go with motor_angle {gear} (their correlation is {together:.2g})"
        remedy = "look at both columns: an encoder that starts anew each turn, a sensor that stands still for a time"
    else:
        return
    raise InputError(Problem(f"{m.origin}: {what}", remedy=remedy))


def _must_go_with_the_voltage(m: Measurement, model: Model) -> None:
    """Refuse an angle whose sign would make the motor a generator.

    The integral of voltage times velocity is K_e times that of the squared velocity, plus R / K_t times the friction
    loss, plus at most R / K_t times the energy that the springs hold over the travel.
    """
    v = model.values
    velocity = np.gradient(m.angle) * m.rate
    travel = float(np.ptp(m.angle))
    spring = max(v.preload_open + v.slope_open * travel, v.preload_close + v.slope_close * travel)
    kept = v.resistance / v.torque_per_ampere * spring * travel
    taken = v.back_emf * float(velocity @ velocity) * m.dt
    if float(m.voltage @ velocity) * m.dt > -kept - _AGAINST * taken:
        return
    remedy = "turn the angle's sign if it falls when the plate opens, else the voltage's and the current's"
    raise InputError(Problem(f"{m.origin}: the angle goes against motor_voltage", remedy=remedy))
