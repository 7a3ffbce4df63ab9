"""Plots that only some runs have: break-away over the rate of the torque, and friction over temperature."""

from __future__ import annotations

import math

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from etb_hil.recording.samples import Float64
from etb_hil.report.drawing import CLOSING, MEASURED, OPENING, STYLE, legend_below, new_figure
from etb_hil.report.series import ReportSeries
from etb_hil.results.run_result import RunResult

_LEAST_ROOM = 0.1  # share of the torque that the plot shows above and below: a small change shall look like one
_WARMED = 5.0  # K that a run must have warmed by
_BIN, _FEWEST = 1.0, 10  # K, and points in it
_SLOW, _FAST = 0.15, 1.5  # times omega_s: below, friction is T_st within 2 % of the drop; above, nearly T_c


@mpl.rc_context(STYLE)
def break_away_over_rate(series: ReportSeries, results: RunResult) -> Figure | None:  # noqa: ARG001 (one signature for all)
    """Draw what it took to break away over how fast the torque rose; None where it rose equally everywhere."""
    if not len(series.ramp_rate):
        return None
    figure, (axes,) = new_figure(5.2, 4.2)
    axes.set(title="Break-away over rate", xlabel="rate of the torque / N·m/s", ylabel="break-away torque / N·m")
    axes.set_xscale("log")
    for sign, colour, marker, name in ((1.0, OPENING, "^", "opening"), (-1.0, CLOSING, "v", "closing")):
        way = sign * series.break_away_torque > 0.0
        rate, torque = series.break_away_rate[way], sign * series.break_away_torque[way]
        axes.plot(rate, torque, marker, color=colour, markersize=5, alpha=0.75, linestyle="", label=name)
    reach = [series.ramp_torque - series.ramp_low, series.ramp_high - series.ramp_torque]
    label = "mean of both, 95 % of its scatter"
    axes.errorbar(series.ramp_rate, series.ramp_torque, yerr=reach, fmt="o-", color=MEASURED, capsize=4, label=label)
    middle = float(np.mean(series.ramp_torque))
    room = max(_LEAST_ROOM * middle, 1.2 * float(np.max(np.abs(np.abs(series.break_away_torque) - middle))))
    axes.set_ylim(middle - room, middle + room)
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    legend_below(figure, 2)
    return figure


@mpl.rc_context(STYLE)
def friction_over_temperature(series: ReportSeries, results: RunResult) -> Figure | None:
    """Draw T_st and T_c as the plate showed them at each temperature, with the law; None where it hardly warmed.

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
    figure, (axes,) = new_figure(5.2, 4.2)
    axes.set(title="Friction over temperature", xlabel="temperature / °C", ylabel="friction torque / N·m")
    for name, colour, marker, middle, torque, level, slope in shown:
        axes.plot(middle, torque, marker, color=colour, markersize=4, label=f"{name}, median over {_BIN:g} K")
        axes.plot(middle, level * np.exp(slope * middle), color=colour, label=f"{name}: {100.0 * slope:+.2f} %/K")
    legend_below(figure, 2)
    return figure


def _medians(temperature: Float64, share: Float64) -> tuple[Float64, Float64]:
    """Return the middles of the segments of temperature that have points enough, and the median of each."""
    which = np.floor(temperature / _BIN)
    filled = [value for value in np.unique(which) if np.count_nonzero(which == value) >= _FEWEST]
    medians = [float(np.median(share[which == value])) for value in filled]
    return (np.array(filled) + 0.5) * _BIN, np.array(medians)


def _law(temperature: Float64, share: Float64) -> tuple[float, float] | None:
    """Return the change a K, as a share, and the factor at 0 degC; None where the temperatures are too near."""
    sound = share > 0.0
    if np.count_nonzero(sound) < 3 or np.ptp(temperature[sound]) < _WARMED - _BIN:
        return None
    slope, level = np.polyfit(temperature[sound], np.log(share[sound]), 1)
    return float(slope), math.exp(float(level))
