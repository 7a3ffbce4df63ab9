"""Columns for the plots of a diagnosis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.diagnosis.assessment import Assessment
from etb_hil.diagnosis.break_away import BreakAway, at_rates
from etb_hil.diagnosis.bump_fit import excess_of
from etb_hil.diagnosis.contradiction import Widening
from etb_hil.diagnosis.fitted_numbers import fitted_curve
from etb_hil.diagnosis.friction_model import peak_left
from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.interval import Interval
from etb_hil.diagnosis.stribeck_fit import StribeckFit
from etb_hil.recording.samples import Float64

_POINTS = 201
_SLOW = 0.3  # of the highest speed: beyond it, friction over angle would show the Stribeck curve


def break_away_columns(rests: Sequence[BreakAway]) -> dict[str, Float64]:
    """Return the columns of break-aways.

    With them come those of their means, where the torque rose at several rates. The means' intervals hold their scatter
    alone: what is wrong with the motor's constant moves all rates equally.
    """
    rated = [one for one in rests if one.rate > 0.0]
    if not rated:
        return {}
    columns = {
        "break_away_rate": np.array([one.rate for one in rated]),
        "break_away_torque": np.array([one.direction * one.torque for one in rated]),
        "break_away_rest": np.array([one.rest for one in rated]),
        "break_away_angle": np.array([one.angle for one in rated]),
    }
    means = at_rates(rests)
    if not means:
        return columns
    return columns | {
        "ramp_rate": np.array([rate for rate, _ in means]),
        "ramp_torque": np.array([found.value for _, found in means]),
        "ramp_low": np.array([found.low for _, found in means]),
        "ramp_high": np.array([found.high for _, found in means]),
    }


def plot_columns(assessment: Assessment, widening: Widening) -> dict[str, Float64]:
    """Return the columns that `DiagnosisResult.series` names.

    Groups that the run does not carry are left out. The curve's band holds what the numbers' intervals hold of friction
    at a speed: its gain and an uneven way. How it parts into T_c and viscosity, which other laws of friction leave
    open, is the numbers' alone.
    """
    evidence, fit = assessment.evidence, assessment.fit
    ticks = evidence.ticks
    columns = {
        "time": ticks.time,
        "angle": ticks.angle,
        "velocity": ticks.velocity,
        "current": ticks.current,
        "friction": ticks.friction,
        "temperature": ticks.temperature,
    }
    if fit is None:
        return columns
    fastest = float(np.abs(evidence.velocity).max())
    speeds: Float64 = np.arange(0, _POINTS, 2, dtype=np.float64) * (fastest / (_POINTS - 1))
    value, error = fitted_curve(fit, speeds)
    low, high = _band(speeds, value, error, widening, fit)
    slow = np.abs(evidence.velocity) < _SLOW * fastest
    opening, closing = slow & (evidence.velocity > 0.0), slow & (evidence.velocity < 0.0)
    return columns | {
        "point_velocity": evidence.velocity,
        "point_friction": fit.friction,
        "point_angle": evidence.position,
        "point_temperature": ticks.temperature[evidence.windows.centre],
        "point_excess": excess_of(evidence, fit),
        "point_overlap": np.full(len(evidence), evidence.overlap),
        "curve_velocity": _both_ways(speeds, speeds),
        "curve_friction": _both_ways(value, value),
        "curve_low": _both_ways(high, low),
        "curve_high": _both_ways(low, high),
        "opening_angle": evidence.position[opening],
        "opening_friction": fit.friction[opening],
        "closing_angle": evidence.position[closing],
        "closing_friction": fit.friction[closing],
    }


def _band(
    speeds: Float64, value: Float64, error: Float64, widening: Widening, fit: StribeckFit
) -> tuple[Float64, Float64]:
    """Return the lower and the upper edge of a curve's 95 % band at speeds (n) >= 0."""
    low, high = np.empty(len(speeds)), np.empty(len(speeds))
    for k, (speed, level, reach) in enumerate(
        zip(speeds.tolist(), value.tolist(), (TWO_SIDED_95 * error).tolist(), strict=True)
    ):
        along = Interval(level, level - reach, level + reach)
        edges = widening.of_curve(along, 1.0 - peak_left(speed, fit.parameters))
        low[k], high[k] = sorted((edges.low, edges.high))
    return low, high


def _both_ways(backward: Float64, forward: Float64) -> Float64:
    """Return the curve of both directions, of values (n) from rest on.

    Friction is odd: backward it is that of the same speed forward, with the other sign.
    """
    return np.concatenate([-backward[:0:-1], forward])
