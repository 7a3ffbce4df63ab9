"""The plots of a run: friction over speed, friction over angle, and the traces over time."""

from __future__ import annotations

import math

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from etb_hil.diagnosis.friction_map import CELL, TEMPERATURE_CELL, FrictionMap, find_bumps, friction_map
from etb_hil.recording.samples import Float64
from etb_hil.report.drawing import (
    CLOSING,
    INK,
    LIMIT,
    MEASURED,
    MUTED,
    OPENING,
    STYLE,
    broken_at_gaps,
    envelope,
    legend_below,
    new_figure,
    say_empty,
    thinned,
)
from etb_hil.report.series import ReportSeries
from etb_hil.report.show import phase_name
from etb_hil.results.run_result import Phase, RunResult

_FAR_ABOVE = 2.15  # beyond this many omega_s the Stribeck curve has fallen to T_c within 1 %

_STRETCHES, _FEWEST = 24, 3  # of angle, and points in one
_TURNS = 0.7  # share of the median friction: a plate with less is on its way round, or breaking away
_MAPPED = ("point_angle", "point_velocity", "point_excess", "point_temperature")
_DEEPEST, _FAINTEST = 0.1, 0.08  # share off the curve that has the full colour at the least; colour of none
_LEVEL = 0.01  # share off the curve that is none

FRICTION = "friction torque / N·m"


@mpl.rc_context(STYLE)
def friction_over_speed(series: ReportSeries, results: RunResult) -> Figure:
    """Draw the estimated friction over speed with the fitted Stribeck curve, its 95 % band and the limits."""
    figure, (axes,) = new_figure(5.2, 4.2)
    axes.set(title="Friction over speed", xlabel="throttle speed / deg/s", ylabel=FRICTION)
    if not len(series.point_velocity) and not len(series.curve_velocity):
        say_empty(axes, "no friction estimated in this run")
        return figure
    if len(series.point_velocity):
        velocity, friction = thinned(np.degrees(series.point_velocity), series.point_friction)
        axes.plot(velocity, friction, ".", color=MUTED, markersize=2.5, alpha=0.55, label="estimated")
    if len(series.curve_velocity):
        for side in (series.curve_velocity < 0, series.curve_velocity >= 0):
            velocity = np.degrees(series.curve_velocity[side])
            if len(series.curve_low):
                low, high = series.curve_low[side], series.curve_high[side]
                label = "its 95 % band" if side[-1] else None
                axes.fill_between(velocity, low, high, color=MEASURED, alpha=0.35, linewidth=0, label=label)
            label = "fitted curve" if side[-1] else None
            axes.plot(velocity, series.curve_friction[side], color=MEASURED, linewidth=1.0, label=label)
    _speed_limits(axes, results)
    axes.axhline(0, color=MUTED, linewidth=0.8)
    axes.axvline(0, color=MUTED, linewidth=0.8)
    legend_below(figure, 2)
    return figure


def _speed_limits(axes: Axes, results: RunResult) -> None:
    """Draw each limit where it is compared: T_st below omega_s, T_c (and the viscous torque) far above it."""
    reach = max(abs(bound) for bound in axes.get_xlim())
    axes.set_xlim(-reach, reach)
    omega_s = math.degrees(results.measurements.value("omega_s") or 0.0)
    near = min(omega_s, reach) if omega_s else reach
    slope = results.measurements.value("viscous") or 0.0
    stiction, coulomb = _limit(results, "T_st"), _limit(results, "T_c")
    for sign in (1.0, -1.0):
        if stiction is not None:
            label = f"limit T_st {stiction:.3f} N·m" if sign > 0 else None
            axes.plot([-near, near], [sign * stiction] * 2, color=LIMIT, linestyle="--", linewidth=1.6, label=label)
        far = _FAR_ABOVE * omega_s if omega_s else 0.0
        if coulomb is not None and far < reach:
            label = f"limit T_c {coulomb:.3f} N·m{' + viscous' if slope else ''}" if sign > 0 else None
            speed = sign * np.array([far, reach])
            torque = sign * (coulomb + slope * np.radians(np.abs(speed)))
            axes.plot(speed, torque, color=LIMIT, linestyle=":", linewidth=2, label=label)


@mpl.rc_context(STYLE)
def friction_over_angle(series: ReportSeries, results: RunResult) -> Figure:
    """Draw the friction over the angle, opening and closing apart; below, the map over angle and temperature."""
    over = friction_map([{name: getattr(series, name) for name in _MAPPED}]) if len(series.point_excess) else None
    shows = over is not None and _says_something(over)
    figure, (axes, *others) = new_figure(5.2, 4.2, rows=2, ratios=[2.2, 1.0]) if shows else new_figure(5.2, 4.2)
    axes.set(title="Friction over angle", ylabel=FRICTION)
    if over is not None and shows:
        others[0].set(title="Above or below the fitted curve", ylabel="temperature / °C")
        _map(others[0], over)
    [axes, *others][-1].set_xlabel("throttle angle / deg")
    if not len(series.opening_angle) and not len(series.closing_angle):
        say_empty(axes, "no friction estimated in this run")
        return figure
    for name, sign, colour, style, angle, friction in (
        ("opening", 1.0, OPENING, "-", series.opening_angle, series.opening_friction),
        ("closing", -1.0, CLOSING, "-.", series.closing_angle, series.closing_friction),
    ):
        if len(angle):
            points = thinned(np.degrees(angle), friction)
            axes.plot(*points, ".", color=colour, markersize=2.0, alpha=0.35)
            slides = sign * friction > _TURNS * np.median(sign * friction)
            medians = _medians(np.degrees(angle[slides]), friction[slides])
            axes.plot(*medians, style, color=colour, linewidth=2, label=f"{name}, median of sliding")
    stiction, coulomb = _limit(results, "T_st"), _limit(results, "T_c")
    _level(axes, stiction, "--", "limit T_st")
    _level(axes, coulomb, ":", "limit T_c")
    axes.axhline(0, color=MUTED, linewidth=0.8)
    legend_below(figure, 2)
    return figure


def _says_something(over: FrictionMap) -> bool:
    """Return whether a map has more than one temperature, or a cell that is off the curve; else it is all grey."""
    return len(over.temperature) > 1 or float(np.nanmax(np.abs(over.factor - 1.0), initial=0.0)) >= _LEVEL


def _map(axes: Axes, over: FrictionMap) -> None:
    """Draw friction as a factor on the fitted curve, a cell 2 deg wide and 10 K high; the deeper, the further off."""
    axes.grid(visible=False)
    excess = over.factor - 1.0
    deepest = max(_DEEPEST, float(np.nanmax(np.abs(excess), initial=0.0)))
    for row, temperature in enumerate(over.temperature):
        for column in np.flatnonzero(np.isfinite(excess[row])):
            corner = (math.degrees(over.angle[column] - 0.5 * CELL), float(temperature) - 0.5 * TEMPERATURE_CELL)
            share = float(excess[row, column])
            colour = MUTED if abs(share) < _LEVEL else LIMIT if share > 0.0 else MEASURED
            depth = _FAINTEST + (1.0 - _FAINTEST) * (abs(share) / deepest)  # one at the most: rounded as it stands
            cell = Rectangle(corner, math.degrees(CELL), TEMPERATURE_CELL, facecolor=colour, alpha=depth, linewidth=0)
            axes.add_patch(cell)
    axes.plot([], [], "s", color=MUTED, alpha=0.2, label=f"within {100.0 * _LEVEL:g} % of the curve")
    for sign, colour, words in ((1.0, LIMIT, "above"), (-1.0, MEASURED, "below")):
        most = float(np.nanmax(sign * excess, initial=0.0))
        if most >= _LEVEL:
            axes.plot([], [], "s", color=colour, alpha=0.6, label=f"{words} the curve, at most {100.0 * most:.1f} %")
    middles = np.degrees([bump.angle for bump in find_bumps(over)])
    if len(middles):
        axes.plot(middles, np.full(len(middles), over.temperature[-1]), "v", color=INK, markersize=5, label="bump")
    half = 0.5 * TEMPERATURE_CELL
    axes.set_ylim(float(over.temperature[0]) - half, float(over.temperature[-1]) + half)


@mpl.rc_context(STYLE)
def time_traces(series: ReportSeries, results: RunResult) -> Figure:
    """Draw angle, velocity, current and friction over time; phases as a strip, exceedances shaded and marked."""
    figure, (strip, *rows) = new_figure(10.4, 6.2, rows=5, ratios=[0.16, 1, 1, 1, 1.3])
    strip.set(title="Traces over time", yticks=[], ylim=(0, 1))
    strip.grid(visible=False)
    strip.spines[:].set_visible(False)
    strip.tick_params(bottom=False)
    rows[-1].set_xlabel("time / s")
    friction = rows[-1]
    traces = (
        ("angle / deg", np.degrees(series.angle)),
        ("velocity / deg/s", np.degrees(series.velocity)),
        ("current / A", series.current),
        ("friction / N·m", series.friction),
    )
    for axes, (label, values) in zip(rows, traces, strict=True):
        axes.set_ylabel(label)
        if len(values) and not np.all(np.isnan(values)):
            axes.plot(*broken_at_gaps(*envelope(series.time, values)), color=MEASURED, linewidth=1.0)
        else:
            say_empty(axes, "not measured in this run")
    figure.align_ylabels(rows)
    instants = [*series.time[[0, -1]]] if len(series.time) else []
    instants += [p.start_s for p in results.phases] + [p.end_s for p in results.phases if p.end_s is not None]
    if instants and max(instants) > min(instants):
        strip.set_xlim(min(instants), max(instants))
    _phase_strip(strip, rows, results.phases)
    _level(friction, _limit(results, "T_st"), "--", "limit T_st")
    _level(friction, _limit(results, "T_c"), ":", "limit T_c")
    for index, episode in enumerate(results.exceedances):
        for axes in rows:
            axes.axvspan(episode.start_s, episode.end_s, color=LIMIT, alpha=0.22, linewidth=0)
        middle = 0.5 * (episode.start_s + episode.end_s)
        name = "exceedance" if index == 0 else None
        peak = math.copysign(episode.peak, episode.velocity or 1.0)  # friction has the direction of the motion
        friction.plot([middle], [peak], "v", color=LIMIT, markersize=6, label=name)
    legend_below(figure, 3)
    return figure


def _medians(angle: Float64, friction: Float64) -> tuple[Float64, Float64]:
    """Return middle angle and median friction of equal segments of angle, NaN where there is next to nothing."""
    edges = np.linspace(angle.min(), angle.max(), _STRETCHES + 1)
    which = np.clip(np.searchsorted(edges, angle, side="right") - 1, 0, _STRETCHES - 1)
    parts = [friction[which == k] for k in range(_STRETCHES)]
    medians = [float(np.median(part)) if len(part) >= _FEWEST else np.nan for part in parts]
    return 0.5 * (edges[1:] + edges[:-1]), np.array(medians)


def _phase_strip(strip: Axes, rows: list[Axes], phases: tuple[Phase, ...]) -> None:
    start, end = strip.get_xlim()
    for index, phase in enumerate(phases):
        stop = phase.end_s if phase.end_s is not None else end
        strip.axvspan(phase.start_s, stop, color=MUTED, alpha=0.15 if index % 2 else 0.35, linewidth=0)
        for axes in rows:
            axes.axvline(phase.start_s, color=MUTED, linewidth=0.6, linestyle=(0, (2, 3)))
        share = (stop - phase.start_s) / (end - start)
        name = f"{index + 1} {phase_name(phase)}"
        fits = share * 125 > len(name)  # 125 characters of this size fit across the figure
        label = name if fits else str(index + 1) if share > 0.012 else ""
        middle = 0.5 * (phase.start_s + stop)
        strip.text(middle, 0.45, label, ha="center", va="center", fontsize=8, color=INK, clip_on=True)


def _level(axes: Axes, level: float | None, style: str, name: str) -> None:
    if level is not None:
        axes.axhline(level, color=LIMIT, linestyle=style, label=f"{name} {level:.3f} N·m")
        axes.axhline(-level, color=LIMIT, linestyle=style)


def _limit(results: RunResult, measurement_id: str) -> float | None:
    found = results.measurements.get(measurement_id)
    return None if found is None else found.limit_high
