"""The numbers of a result: fitted ones with intervals and limits, the paper's own readings, and what they rest on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from etb_hil.diagnosis.assessment import Assessment, Interval, fitted_numbers
from etb_hil.diagnosis.break_away import READING, BreakAway, BreakAwayTorque, at_rates, break_away_torque
from etb_hil.diagnosis.contradiction import Widening, widened
from etb_hil.diagnosis.current_zero import Zero
from etb_hil.diagnosis.friction_map import CELL, FASTEST, find_bumps, friction_map
from etb_hil.diagnosis.limits import Limits
from etb_hil.diagnosis.prior import CONSTANT
from etb_hil.diagnosis.result import Number
from etb_hil.diagnosis.tally import LiveReading
from etb_hil.diagnosis.verdict import stand
from etb_hil.diagnosis.voltage_balance import VoltageBalance
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.recording.samples import Float64

_NAMES = {
    "T_st": ("stiction torque T_st", "N·m"),
    "T_c": ("Coulomb torque T_c", "N·m"),
    "return_margin": ("return margin", "N·m"),
    "omega_s": ("Stribeck velocity omega_s", "rad/s"),
    "viscous": ("viscous coefficient sigma_2", "N·m·s/rad"),
}


_OF_MOTOR = frozenset({"back_emf", "resistance"})


def report_numbers(
    assessment: Assessment,
    broken_away: Sequence[BreakAway],
    reading: LiveReading,
    zero: Zero,
    limits: Limits,
    throttle: ThrottleParameters,
    widening: Widening,
) -> tuple[Number, ...]:
    """Return every number of a run, those that decide first."""
    gear = throttle.gear_ratio
    bounds = {
        "T_st": (None, limits.stiction.at_throttle(gear, zero.temperature)),
        "T_c": (None, limits.coulomb.at_throttle(gear, zero.temperature)),
        "return_margin": (limits.return_margin.at_throttle(gear), None),
    }
    fitted: dict[str, Interval] = {}
    if assessment.fit is not None:
        fitted = fitted_numbers(assessment.fit, throttle, assessment.fastest, assessment.hardest)
    numbers = []
    for name in _NAMES:
        if name in fitted:
            low, high = bounds.get(name, (None, None))
            numbers.append(_fitted(name, _widened(name, fitted, widening), low, high, limits.marginal_band))
    scale = 1.0 if assessment.fit is None else 1.0 + float(assessment.fit.parameters[CONSTANT])
    breaking = _broken_away(broken_away, scale, widening.gain, limits, bounds["T_st"][1])
    return (*numbers, *breaking, *_paper(reading), *_motor(assessment.balance), *_basis(assessment, reading, zero))


def without_intervals(numbers: Sequence[Number]) -> tuple[Number, ...]:
    """Return the numbers with no interval of friction: nothing bounds it where motor, springs or angle are others."""
    return tuple(n if n.id in _OF_MOTOR else replace(n, low=None, high=None) for n in numbers)


def _widened(name: str, fitted: Mapping[str, Interval], by: Widening) -> Interval:
    found = fitted[name]
    if name == "omega_s":  # a speed; the rest are torques, or torques over speeds
        return found
    if name == "T_st":
        found = by.of_stiction(found)
    if name == "T_c":
        found = by.of_coulomb(found, fitted["T_st"])
    if name == "return_margin":
        found = by.of_margin(found, fitted["T_st"].value)
    least, most = widened(found.value, found.low, found.high, by.gain)
    return Interval(found.value, found.low if found.low == 0.0 else least, most)


def _fitted(name: str, interval: Interval, limit_low: float | None, limit_high: float | None, band: float) -> Number:
    words, unit = _NAMES[name]
    verdict = None
    if limit_low is not None or limit_high is not None:
        verdict = stand(interval.value, interval.low, interval.high, limit_low, limit_high, band)
    return Number(name, words, interval.value, unit, interval.low, interval.high, limit_low, limit_high, verdict)


def _broken_away(
    rests: Sequence[BreakAway], scale: float, gain: tuple[float, float], limits: Limits, limit: float | None
) -> tuple[Number, ...]:
    """Return T_st as break-aways from rest show it, and what longer rests and quicker ramps do; nothing from too few.

    It is judged where the limits know the law of rest, at the rest that they are stated for.
    """
    law = limits.stiction.dwell
    grown = None if law is None else law.factor
    found = break_away_torque(rests, grown)
    if found is None:
        return ()

    def bounds(torque: BreakAwayTorque) -> tuple[float, float, float]:
        value, reading = scale * torque.value, READING * scale * torque.value
        return value, *widened(value, scale * torque.low - reading, scale * torque.high + reading, gain)

    name, note = "T_st from break-aways", f"mean of {found.count}, in both directions"
    value, low, high = bounds(found)
    number = Number("T_st_break_away", name, value, "N·m", low, high, note=note)
    if law is not None:
        verdict = stand(value, low, high, None, limit, limits.marginal_band)
        note += f", brought to a rest of {law.reference:g} s"
        number = replace(number, limit_high=limit, verdict=verdict, note=note)
    slopes = (
        ("break_away_per_decade", "more T_st per ten times longer rest", found.per_decade),
        ("break_away_per_rate", "more T_st per ten times quicker ramp", found.per_rate),
    )
    return (
        number,
        *(Number(name, words, slope[0], "1", *slope[1:]) for name, words, slope in slopes if slope is not None),
        *(_at_rate(k, rate, bounds(one), one.count) for k, (rate, one) in enumerate(at_rates(rests, grown), 1)),
    )


def _at_rate(number: int, rate: float, found: tuple[float, float, float], count: int) -> Number:
    value, low, high = found
    words = f"T_st breaking away at {rate:.2g} N·m/s"
    return Number(f"T_st_at_rate_{number}", words, value, "N·m", low, high, note=f"mean of {count}")


def bump_numbers(series: Mapping[str, Float64]) -> tuple[Number, ...]:
    """Return where friction is locally above the fitted curve, in order of angle, by the columns for the plots.

    Without intervals: a cell's mean stays below the peak in it.
    """
    if "point_excess" not in series or not np.any(np.abs(series["point_velocity"]) < FASTEST):
        return ()
    alike = np.full(len(series["point_angle"]), np.nan)  # one run is one temperature
    return tuple(
        Number(
            f"bump_{k}",
            f"friction above the curve at {bump.angle:.2f} rad",
            bump.excess,
            "1",
            note=f"mean over {CELL:g} rad, the peak is higher; from {bump.start:.2f} to {bump.end:.2f} rad",
        )
        for k, bump in enumerate(find_bumps(friction_map([{**series, "point_temperature": alike}])), 1)
    )


def _paper(reading: LiveReading) -> tuple[Number, ...]:
    strategy = "seed paper, section III.C, strategy"
    return (
        Number("T_st_live", "T_st from slow sliding, live", reading.stiction, "N·m"),
        Number("T_st_peak", "highest estimate below omega_s", reading.peak, "N·m", note=f"{strategy} 1"),
        Number(
            "T_c_live",
            "friction beyond 2.15 omega_s less viscosity",
            reading.coulomb,
            "N·m",
            note=f"{strategy} 2, corrected",
        ),
        Number(
            "T_c_literal",
            "friction beyond 2.15 omega_s",
            reading.coulomb_literal,
            "N·m",
            note=f"{strategy} 2 as printed",
        ),
    )


def _motor(balance: VoltageBalance | None) -> tuple[Number, ...]:
    if balance is None:
        return ()
    return tuple(
        Number(name, words, value, unit, value - 1.96 * error, value + 1.96 * error)
        for name, words, value, unit, error in (
            ("back_emf", "back-EMF constant K_e G_r", balance.back_emf, "V·s/rad", balance.back_emf_error),
            ("resistance", "resistance R_a", balance.resistance, "ohm", balance.resistance_error),
        )
    )


def _basis(assessment: Assessment, reading: LiveReading, zero: Zero) -> tuple[Number, ...]:
    return (
        Number("fastest", "highest speed", reading.fastest, "rad/s"),
        Number("current_zero", "zero of the current sensor", zero.current if zero.is_measured else None, "A"),
        Number("current_noise", "noise of the current sensor", zero.noise if zero.is_measured else None, "A"),
        Number("temperature", "temperature when the current's zero was measured", _known(zero.temperature), "degC"),
        Number("windows", "windows behind the fit", float(len(assessment.windows)), "1"),
    )


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value
