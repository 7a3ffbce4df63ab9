"""Plausibility of voltage, current, angles, temperature: units, columns, signs."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.discrepancy.measured.measurement import Measurement, voltage_rms
from etb_hil.discrepancy.measured.sampling import in_blocks
from etb_hil.plant.model_file import Sensors
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import spring_torque
from etb_hil.recording.samples import Float64

DEGREES = math.degrees(1.0)  # values in rad whose unit says deg are read this many times too small
TOO_FAR = 1.3  # times the way between the model's stops: a plate presses into them, and a model may be off
_HALF = 0.5  # of the way between the stops
_SUSPECTED = {
    ("rad", "deg"): (1.0 / DEGREES, "57.3 times too small"),
    ("deg", "rad"): (DEGREES, "57.3 times too large"),
    ("A", "mA"): (1e-3, "1000 times too small"),
    ("mA", "A"): (1e3, "1000 times too large"),
    ("mV", "V"): (1e3, "1000 times too large"),
}
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
# Of a current:
_POWERED = 0.05  # of the voltage's limit; below it an open bridge and two sensors' zeros may show anything
_BRAKES = 3.0  # times V/R: a motor that is braked at full speed comes to 2
_HARDLY = 30.0  # times less than V/R: halfway to a thousand
_BLOCK = 0.02  # s: many times L/R, what a current is late by, and enough for the noise of a difference
_NEAR_REST = 0.25  # of the voltage that the back-EMF may take
_FEWEST = 25  # blocks near rest: half a second
_BACKWARDS = 1.0 / 3.0  # of V/R: R may be far off the model's, and a current that is its sensor's zero alone is less
_NEARLY_ALL = 0.9  # of those blocks
_STAYS = 5  # samples: within its range noise brings a sensor off a value sooner, and L/R is past
_MORE = 1.1  # times the value that the voltage drives: R may be off
_NOISE = 3.0  # times the sensor's, by which it does at least


def must_be_of_throttle(segments: Sequence[Measurement], model: Model) -> None:
    """Refuse an implausible voltage or temperature, and angles of different motions."""
    if driven := [m for m in segments if m.device.has_winding]:
        voltage, angle = (np.concatenate([getattr(m, name) for m in driven]) for name in ("voltage", "angle"))
        must_be_driven(driven[0].origin, voltage, angle, model.sensors)
    for m in segments:
        if m.device.has_winding:
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


def must_be_of_winding(segments: Sequence[Measurement], model: Model) -> None:
    """Refuse a current in a wrong unit, clipped, or with a sign against the voltage."""
    pairs = [(m, m.current) for m in segments if m.current is not None and m.device.has_winding]
    if not pairs:
        return
    origin, resistance = segments[0].origin, model.values.resistance
    volts = _greatest([m.voltage for m, _ in pairs])
    if volts <= _POWERED * model.values.voltage_limit:
        return
    _must_be_in_its_unit(origin, volts, _greatest([current for _, current in pairs]), resistance)
    for m, current in pairs:
        _must_be_within_its_range(m, current, model)
    _current_must_follow_the_voltage(
        origin, np.concatenate([_shares_near_rest(m, current, model) for m, current in pairs])
    )


def _must_be_in_its_unit(origin: str, volts: float, amperes: float, resistance: float) -> None:
    """Refuse a current far from V/R at the greatest voltage: mA are no A."""
    allowed = volts / resistance
    if allowed / _HARDLY <= amperes <= _BRAKES * allowed:
        return
    what, pair = ("is far above", ("mA", "A")) if amperes > allowed else ("is far below", ("A", "mA"))
    as_meant = amperes / off_by(*pair)
    label = f"; {suspected(*pair)}" if allowed / _HARDLY <= as_meant <= _BRAKES * allowed else ""
    by = f"the model's R of {resistance:.3g} ohm allows at the greatest voltage, {volts:.3g} V: {allowed:.3g} A"
    remedy = "check its unit (A or mA) in the column's header or in the map, or leave the column out"
    raise InputError(
        Problem(f"{origin}: motor_current goes up to {amperes:.3g} A, which {what} what {by}{label}", remedy=remedy)
    )


def _must_be_within_its_range(m: Measurement, current: Float64, model: Model) -> None:
    """Refuse a current clipped at its extremes while the voltage drives more."""
    v, sensors = model.values, m.sensors
    driven = (m.voltage - v.back_emf * np.gradient(m.angle) * m.rate) / v.resistance
    least = _NOISE * float(np.hypot(sensors.current_noise, sensors.current_step))
    for sign in (1.0, -1.0):
        end = float((sign * current).max())
        is_cut = (sign * current == end) & (sign * driven > _MORE * max(end, 0.0) + least) & m.is_good
        edges = np.flatnonzero(np.diff(is_cut, prepend=False, append=False)).reshape(-1, 2)
        if (edges[:, 1] - edges[:, 0] >= _STAYS).any():
            much = f"in {100.0 * float(np.mean(sign * current == end)):.3g} % of the samples"
            more = f"{sign * float((sign * driven[is_cut]).max()):.3g} A"
            what = f"{m.origin}: motor_current stays at {sign * end:.3g} A {much} while the voltage drives up to {more}"
            remedy = "its sensor's range ends there: use one that reads further, or leave the column out"
            raise InputError(Problem(what, remedy=remedy))


def _current_must_follow_the_voltage(origin: str, shares: Float64) -> None:
    """Refuse a current whose sign near rest, where it is V/R, is against the voltage."""
    if len(shares) < _FEWEST or np.median(shares) > -_BACKWARDS or np.mean(shares < 0.0) < _NEARLY_ALL:
        return
    seconds = f"in {len(shares) * _BLOCK:.2g} s of a motor nearly at rest it is {np.median(shares):.2g} times V/R"
    remedy = "turn its sign (a clamp that is the wrong way round), or the voltage's if that is the wrong one"
    raise InputError(Problem(f"{origin}: motor_current runs against motor_voltage: {seconds}", remedy=remedy))


def _shares_near_rest(m: Measurement, current: Float64, model: Model) -> Float64:
    """Return the current over V/R (k) of every block with hardly any back-EMF."""
    v = model.values
    samples = max(round(_BLOCK * m.rate), 2)
    voltage, amperes, angle, is_good = (
        in_blocks(values, samples) for values in (m.voltage, current, m.angle, m.is_good)
    )
    volts = voltage.mean(axis=1)
    back_emf = v.back_emf * np.ptp(angle, axis=1) / ((samples - 1) * m.dt)
    is_powered = np.abs(volts) > _POWERED * v.voltage_limit
    at_rest = is_good.all(axis=1) & is_powered & (back_emf < _NEAR_REST * np.abs(volts))
    return v.resistance * amperes.mean(axis=1)[at_rest] / volts[at_rest]


def _greatest(columns: Sequence[Float64]) -> float:
    return float(np.quantile(np.abs(np.concatenate(columns)), _QUANTILE))


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
    angle, voltage = (in_blocks(column, size).mean(axis=1) for column in (times * m.angle, m.voltage))
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
