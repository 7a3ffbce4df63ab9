"""Plausibility of voltage, angles and temperature: units, columns and signs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.discrepancy.measured.measurement import Measurement, voltage_rms
from etb_hil.discrepancy.measured.unit_mismatch import DEGREES, must_be_labelled_in_its_angle, off_by, suspected
from etb_hil.plant.model_file import Sensors
from etb_hil.plant.parameters import Model
from etb_hil.recording.samples import Float64

_LOWEST_DRIVE = 30.0  # times less than the supply: the geometric mean of 1 and 1,000
_HIGHEST_SUPPLY = 2.0  # times the supply's voltage: a charged battery and diodes come to 1.3
_QUANTILE = 0.999  # of the samples: beyond it are spikes
_CONSTANT = 10.0  # times the voltmeter's noise: the largest range of a constant voltage
_MIDDLE = 0.5  # of the travel: the part that a reversal must cross
_REVERSALS = 3
_COLDEST, _HOTTEST = -60.0, 200.0  # degC of a housing
_LEAST_MOTION = 0.1  # rad of standard deviation; below it, play and sensor errors may dominate
_STANDSTILL = 1e-3  # of the other angle's standard deviation
_TRAVEL_RATIO = 1.25  # larger ratios are not sensor errors
_CORRELATED = 0.9  # correlation of two angles of one motion
_BACK_EMF_SHARE = 1.0 / 3.0  # of the energy that the back-EMF takes: K_e may be wrong


def must_be_of_throttle(segments: Sequence[Measurement], model: Model) -> None:
    """Refuse an implausible voltage or temperature, and angles of different motions."""
    if driven := [m for m in segments if not m.is_drive]:
        voltage, angle = (np.concatenate([getattr(m, name) for m in driven]) for name in ("voltage", "angle"))
        must_be_driven(driven[0].origin, voltage, angle, model.sensors)
    for m in segments:
        if not m.is_drive:
            _must_be_of_supply(m, model)
            _must_be_of_housing(m)
            _must_move_together(m, model)
            _must_follow_the_voltage(m, model)
            must_be_labelled_in_its_angle(m, model)


def must_be_driven(origin: str, voltage: Float64, angle: Float64, sensors: Sensors) -> None:
    """Refuse a constant voltage (n, V) while an angle (n, rad) reverses repeatedly.

    Under a constant voltage a plate moves to its equilibrium and stays there. A ramp in one direction may have a
    constant voltage, too.
    """
    if not is_constant(voltage, sensors):
        return
    place = (angle - angle.min()) / max(float(np.ptp(angle)), 1e-12) - 0.5
    ends = np.sign(place[np.abs(place) > 0.5 * _MIDDLE])
    if np.count_nonzero(np.diff(ends)) < _REVERSALS:
        return
    volts = float(np.median(voltage))
    what = f"{origin}: the motor voltage is constant ({volts:.3g} V) while the angle moves back and forth"
    remedy = "check the column of motor_voltage or motor_duty, and the map: it must hold what drives the motor"
    raise InputError(Problem(what, remedy=remedy))


def is_constant(voltage: Float64, sensors: Sensors) -> bool:
    """Tell whether a voltage (n, V) is constant, spikes and noise excepted."""
    low, high = np.quantile(voltage, [1.0 - _QUANTILE, _QUANTILE]).tolist()
    return bool(high - low <= _CONSTANT * voltage_rms(sensors))


def _must_be_of_supply(m: Measurement, model: Model) -> None:
    """Refuse a voltage far above the model's supply: mV or a duty in per cent."""
    volts, supply = float(np.quantile(np.abs(m.voltage), _QUANTILE)), model.values.supply_voltage
    if volts > _HIGHEST_SUPPLY * supply:
        what = f"{m.origin}: the motor voltage reaches {volts:.3g} V, but the model's supply_voltage is {supply:.3g} V"
        if supply / _LOWEST_DRIVE < volts / off_by("mV", "V") <= _HIGHEST_SUPPLY * supply:
            what += f"; {suspected('mV', 'V')}"
        remedy = "check the unit of the voltage (V or mV) or of the duty (1 or %), and the model's supply_voltage"
        raise InputError(Problem(what, remedy=remedy))


def _must_be_of_housing(m: Measurement) -> None:
    """Refuse a temperature in K."""
    middle = float(np.median(m.temperature))
    if not _COLDEST < middle < _HOTTEST:
        what = f"{m.origin}: the median temperature is {middle:.3g} degC; allowed: {_COLDEST:g} to {_HOTTEST:g} degC"
        remedy = "check its unit (degC or K), or leave the column out"
        raise InputError(Problem(what, remedy=remedy))


def _must_move_together(m: Measurement, model: Model) -> None:
    """Refuse angles of motor and plate that are not the same motion through the gear."""
    motor, plate = m.motor_and_plate
    if motor is None or plate is None:
        return
    motor, plate = motor[m.is_good], plate[m.is_good]
    far = float(np.std(motor)), float(np.std(plate))
    if max(far) < _LEAST_MOTION:
        return
    motor_angle = f"motor_angle divided by the gear ratio of {model.values.gear_ratio:.4g}"
    if min(far) < _STANDSTILL * max(far):
        still, moves = ("throttle_angle", "motor_angle") if far[1] < far[0] else ("motor_angle", "throttle_angle")
        what, remedy = f"{still} is constant while {moves} moves", "check its sensor, or leave the column out"
    elif not 1.0 / _TRAVEL_RATIO < far[1] / far[0] < _TRAVEL_RATIO:
        what = f"throttle_angle moves {far[1] / far[0]:.3g} times as far as {motor_angle}"
        times = far[1] / far[0] / DEGREES, far[0] / far[1] / DEGREES
        if any(1.0 / _TRAVEL_RATIO < one < _TRAVEL_RATIO for one in times):
            what += "; suspected unit mismatch: the larger angle is in deg and labelled rad, or the smaller the reverse"
        remedy = (
            "check the units of both (rad or deg), the order of the columns, and the model's gear_ratio; an encoder "
            "that restarts each turn needs 'wraps: true' in the bench file"
        )
    elif (correlation := float(np.corrcoef(motor, plate)[0, 1])) < -_CORRELATED:
        what = "throttle_angle moves opposite to motor_angle"
        remedy = "invert the sign of the angle that decreases when the plate opens"
    elif correlation < _CORRELATED:
        what = f"throttle_angle does not follow {motor_angle} (correlation {correlation:.2g})"
        remedy = "check both columns for an encoder that restarts each turn, and for a sensor that stops for a time"
    else:
        return
    raise InputError(Problem(f"{m.origin}: {what}", remedy=remedy))


def _must_follow_the_voltage(m: Measurement, model: Model) -> None:
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
    if float(m.voltage @ velocity) * m.dt > -kept - _BACK_EMF_SHARE * taken:
        return
    remedy = "invert the sign of the angle if it decreases when the plate opens, else those of voltage and current"
    raise InputError(Problem(f"{m.origin}: the angle moves opposite to motor_voltage", remedy=remedy))
