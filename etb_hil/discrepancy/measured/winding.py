"""Plausibility of a measured current: unit, range, and sign against the voltage."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.unit_mismatch import off_by, suspected
from etb_hil.plant.parameters import Model
from etb_hil.recording.samples import Float64

_POWERED = 0.05  # of the voltage's limit; below it an open bridge and two sensors' zeros may show anything
_MOST = 0.999  # of the samples: beyond it are spikes
_BRAKES = 3.0  # times V/R: a motor that is braked at full speed comes to 2
_HARDLY = 30.0  # times less than V/R: halfway to a thousand
_BLOCK = 0.02  # s: many times L/R, and what a current is late by
_NEAR_REST = 0.25  # of the voltage that the back-EMF may take
_FEWEST = 25  # blocks near rest: half a second
_BACKWARDS = 1.0 / 3.0  # of V/R: R may be far off the model's, and a current that is its sensor's zero alone is less
_NEARLY_ALL = 0.9  # of those blocks
_STAYS = 5  # samples: within its range noise brings a sensor off a value sooner, and L/R is past
_MORE = 1.1  # times the value that the voltage drives: R may be off
_NOISE = 3.0  # times the sensor's, by which it does at least


def must_be_of_winding(segments: Sequence[Measurement], model: Model) -> None:
    """Refuse a current in a wrong unit, clipped, or with a sign against the voltage."""
    pairs = [(m, m.current) for m in segments if m.current is not None and not m.is_drive]
    if not pairs:
        return
    origin, resistance = segments[0].origin, model.values.resistance
    volts = _greatest([m.voltage for m, _ in pairs])
    if volts <= _POWERED * model.values.voltage_limit:
        return
    _must_be_in_its_unit(origin, volts, _greatest([current for _, current in pairs]), resistance)
    for m, current in pairs:
        _must_be_within_its_range(m, current, model)
    _must_follow_the_voltage(origin, np.concatenate([_shares_near_rest(m, current, model) for m, current in pairs]))


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


def _must_follow_the_voltage(origin: str, shares: Float64) -> None:
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
    count = len(m) // samples
    voltage, amperes, angle, is_good = (
        values[: count * samples].reshape(count, samples) for values in (m.voltage, current, m.angle, m.is_good)
    )
    volts = voltage.mean(axis=1)
    back_emf = v.back_emf * np.ptp(angle, axis=1) / ((samples - 1) * m.dt)
    is_powered = np.abs(volts) > _POWERED * v.voltage_limit
    at_rest = is_good.all(axis=1) & is_powered & (back_emf < _NEAR_REST * np.abs(volts))
    return v.resistance * amperes.mean(axis=1)[at_rest] / volts[at_rest]


def _greatest(columns: Sequence[Float64]) -> float:
    return float(np.quantile(np.abs(np.concatenate(columns)), _MOST))
