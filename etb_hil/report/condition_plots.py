"""Plots that only some runs have.

Break-away over the rate of the torque, and friction over temperature.
"""

from __future__ import annotations

import math

import numpy as np

from etb_hil.recording.samples import Float64
from etb_hil.report.chart import CLOSING, MEASURED, OPENING, Bars, Chart, Panel
from etb_hil.report.series import ReportSeries
from etb_hil.results.run_result import RunResult

_LEAST_ROOM = 0.1  # share of the torque that the plot shows above and below: a small change shall look like one
_WARMED = 5.0  # K that a run must have warmed by
_BIN, _FEWEST = 1.0, 10  # K, and points in it
_SLOW, _FAST = 0.15, 1.5  # times omega_s: below, friction is T_st within 2 % of the drop; above, nearly T_c


def break_away_over_rate(series: ReportSeries, results: RunResult) -> Chart | None:  # noqa: ARG001 (one signature for all)
    """Draw break-away friction over how fast the torque rose.

    The result is None where it rose equally everywhere.
    """
    if not len(series.ramp_rate):
        return None
    panel = Panel("Break-away friction over torque rate", "break-away friction / N·m")
    for sign, colour, marker, name in ((1.0, OPENING, "^", "opening"), (-1.0, CLOSING, "v", "closing")):
        way = sign * series.break_away_torque > 0.0
        rate, torque = series.break_away_rate[way], sign * series.break_away_torque[way]
        panel.line(rate, torque, colour, "", marker=marker, alpha=0.75, label=name)
    label = "mean of both, 95 % of its scatter"
    panel.line(series.ramp_rate, series.ramp_torque, MEASURED, marker="o", label=label)
    panel.marks.append(Bars(series.ramp_rate, series.ramp_low, series.ramp_high, MEASURED))
    middle = float(np.mean(series.ramp_torque))
    room = max(_LEAST_ROOM * middle, 1.2 * float(np.max(np.abs(np.abs(series.break_away_torque) - middle))))
    panel.y_limits = (middle - room, middle + room)
    return Chart(5.2, 4.2, [panel], "rate of the torque / N·m/s", columns=2, is_log=True)


def friction_over_temperature(series: ReportSeries, results: RunResult) -> Chart | None:
    """Draw T_st and T_c over temperature, with the law.

    The result is None where the plate hardly warmed.

    Slow windows tell T_st, fast ones T_c: the fitted number, times what the window lies above the fitted curve.
    """
    temperature, speed = series.point_temperature, np.abs(series.point_velocity)
    omega_s = results.measurements.get("omega_s")
    known = (
        np.isfinite(temperature) & np.isfinite(series.point_excess) if len(series.point_excess) else np.empty(0, bool)
    )
    warmed = temperature[known].max() - temperature[known].min() if known.any() else 0.0
    if warmed < _WARMED or omega_s is None or not omega_s.value:
        return None
    shown = []
    for name, colour, marker, part in (
        ("T_st", CLOSING, "o", known & (speed < _SLOW * omega_s.value)),
        ("T_c", MEASURED, "s", known & (speed > _FAST * omega_s.value)),
    ):
        number = results.measurements.get(name)
        middle, share = _medians(temperature[part], 1.0 + series.point_excess[part])
        law = _law(middle, share)
        if law is not None and number is not None and number.value is not None:
            shown.append((name, colour, marker, middle, number.value * share, number.value * law[1], law[0]))
    if not shown:
        return None
    panel = Panel("Friction over temperature", "friction torque / N·m")
    for name, colour, marker, middle, torque, level, slope in shown:
        panel.line(middle, torque, colour, "", marker=marker, size=4.0, label=f"{name}, median over {_BIN:g} K")
        panel.line(middle, level * np.exp(slope * middle), colour, label=f"{name}: {100.0 * slope:+.2f} %/K")
    return Chart(5.2, 4.2, [panel], "temperature / °C", columns=2)


def _medians(temperature: Float64, share: Float64) -> tuple[Float64, Float64]:
    """Return middle and median of each segment of temperature.

    Segments with too few points are left out.
    """
    which = np.floor(temperature / _BIN)
    filled = [value for value in np.unique(which) if np.count_nonzero(which == value) >= _FEWEST]
    medians = [float(np.median(share[which == value])) for value in filled]
    return (np.array(filled) + 0.5) * _BIN, np.array(medians)


def _law(temperature: Float64, share: Float64) -> tuple[float, float] | None:
    """Return the change a K, as a share, and the factor at 0 degC.

    None where the temperatures are too near.
    """
    sound = share > 0.0
    if np.count_nonzero(sound) < 3 or np.ptp(temperature[sound]) < _WARMED - _BIN:
        return None
    slope, level = np.polyfit(temperature[sound], np.log(share[sound]), 1)
    return float(slope), math.exp(float(level))
