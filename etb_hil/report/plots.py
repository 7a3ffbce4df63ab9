"""The plots of a run: friction over speed and angle, and traces over time."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from etb_hil.diagnosis.friction_map import CELL, TEMPERATURE_CELL, FrictionMap, find_bumps, friction_map
from etb_hil.plant.values import FAR_ABOVE
from etb_hil.recording.samples import Float64
from etb_hil.report.chart import CLOSING, INK, LIMIT, MEASURED, MUTED, OPENING, Band, Box, Chart, Panel, Rule, Text
from etb_hil.report.reduction import broken_at_gaps, envelope, thinned
from etb_hil.report.series import ReportSeries
from etb_hil.report.show import phase_name
from etb_hil.results.run_result import Phase, RunResult

_SEGMENTS, _FEWEST = 24, 3  # of angle, and points in one
_TURNS = 0.7  # share of the median friction: a plate with less is on its way round, or breaking away
_MAPPED = ("point_angle", "point_velocity", "point_excess", "point_temperature")
_DEEPEST, _FAINTEST = 0.1, 0.08  # share off the curve that has the full colour at the least; colour of none
_LEVEL = 0.01  # share off the curve that is none

FRICTION = "friction torque / N·m"


def friction_over_speed(series: ReportSeries, results: RunResult) -> Chart:
    """Draw friction over speed with the fitted curve, its 95 % band and limits."""
    panel = Panel("Friction over speed", FRICTION)
    chart = Chart(5.2, 4.2, [panel], "throttle speed / deg/s", columns=2)
    if not len(series.point_velocity) and not len(series.curve_velocity):
        panel.empty = "no friction estimated in this run"
        return chart
    if len(series.point_velocity):
        velocity, friction = thinned(np.degrees(series.point_velocity), series.point_friction)
        panel.line(velocity, friction, MUTED, "", marker=".", size=2.5, alpha=0.55, label="estimated")
    if len(series.curve_velocity):
        for side in (series.curve_velocity < 0, series.curve_velocity >= 0):
            velocity = np.degrees(series.curve_velocity[side])
            if len(series.curve_low):
                low, high = series.curve_low[side], series.curve_high[side]
                label = "its 95 % band" if side[-1] else None
                panel.marks.append(Band(velocity, low, high, MEASURED, 0.35, label))
            label = "fitted curve" if side[-1] else None
            panel.line(velocity, series.curve_friction[side], MEASURED, width=1.0, label=label)
    reach = max(abs(bound) for bound in chart.x_range())
    chart.x_limits = (-reach, reach)
    _speed_limits(panel, results, reach)
    panel.level(0.0, MUTED, width=0.8)
    panel.marks.append(Rule(0.0, MUTED, is_level=False, width=0.8))
    return chart


def _speed_limits(panel: Panel, results: RunResult, reach: float) -> None:
    """Draw each limit where it is compared.

    T_st is drawn below omega_s, T_c (with the viscous torque, or its bound) far above it.
    """
    omega_s = math.degrees(results.measurements.value("omega_s") or 0.0)
    near = min(omega_s, reach) if omega_s else reach
    viscous = results.measurements.get("viscous")
    slope = 0.0 if viscous is None else viscous.value_or_bound or 0.0
    stiction, coulomb = _limit(results, "T_st"), _limit(results, "T_c")
    for sign in (1.0, -1.0):
        if stiction is not None:
            label = f"limit T_st {stiction:.3f} N·m" if sign > 0 else None
            panel.line([-near, near], [sign * stiction] * 2, LIMIT, "--", width=1.6, label=label)
        far = FAR_ABOVE * omega_s if omega_s else 0.0
        if coulomb is not None and far < reach:
            label = f"limit T_c {coulomb:.3f} N·m{' + viscous' if slope else ''}" if sign > 0 else None
            speed = sign * np.array([far, reach])
            torque = sign * (coulomb + slope * np.radians(np.abs(speed)))
            panel.line(speed, torque, LIMIT, ":", width=2.0, label=label)


def friction_over_angle(series: ReportSeries, results: RunResult) -> Chart:
    """Draw friction over the angle, opening and closing apart.

    Below is the map over angle and temperature.
    """
    over = friction_map([_mapped(series)]) if len(series.point_excess) else None
    panel = Panel("Friction over angle", FRICTION, ratio=2.2)
    chart = Chart(5.2, 4.2, [panel], "throttle angle / deg", columns=2)
    if not len(series.opening_angle) and not len(series.closing_angle):
        panel.empty = "no friction estimated in this run"
    for name, sign, colour, style, angle, friction in (
        ("opening", 1.0, OPENING, "-", series.opening_angle, series.opening_friction),
        ("closing", -1.0, CLOSING, "-.", series.closing_angle, series.closing_friction),
    ):
        if len(angle):
            place, torque = thinned(np.degrees(angle), friction)
            panel.line(place, torque, colour, "", marker=".", size=2.0, alpha=0.35)
            slides = sign * friction > _TURNS * np.median(sign * friction)
            middle, median = _medians(np.degrees(angle[slides]), friction[slides])
            panel.line(middle, median, colour, style, width=2.0, label=f"{name}, median of sliding")
    if not panel.empty:
        _level(panel, _limit(results, "T_st"), "--", "limit T_st")
        _level(panel, _limit(results, "T_c"), ":", "limit T_c")
        panel.level(0.0, MUTED, width=0.8)
    if over is not None and _says_something(over):
        chart.panels.append(_map(over))
    return chart


def _mapped(series: ReportSeries) -> dict[str, Float64]:
    """Return the columns of the map; sessions of older versions have no overlap."""
    overlap = {"point_overlap": series.point_overlap} if len(series.point_overlap) else {}
    return {name: getattr(series, name) for name in _MAPPED} | overlap


def _says_something(over: FrictionMap) -> bool:
    """Return whether a map shows more than grey.

    Such a map has more than one temperature, or a cell that is off the curve.
    """
    return len(over.temperature) > 1 or float(np.nanmax(np.abs(over.factor - 1.0), initial=0.0)) >= _LEVEL


def _map(over: FrictionMap) -> Panel:
    """Draw friction as a factor on the fitted curve.

    A cell is 2 deg wide and 10 K high; the deeper its colour, the further off.
    """
    panel = Panel("Above or below the fitted curve", "temperature / °C", grid=False)
    excess = over.factor - 1.0
    deepest = max(_DEEPEST, float(np.nanmax(np.abs(excess), initial=0.0)))
    wide, high = 0.5 * CELL, 0.5 * TEMPERATURE_CELL
    for row, temperature in enumerate(map(float, over.temperature)):
        for column in np.flatnonzero(np.isfinite(excess[row])):
            angle, share = float(over.angle[column]), float(excess[row, column])
            across = (math.degrees(angle - wide), math.degrees(angle + wide))
            colour = MUTED if abs(share) < _LEVEL else LIMIT if share > 0.0 else MEASURED
            depth = _FAINTEST + (1.0 - _FAINTEST) * (abs(share) / deepest)  # one at the most: rounded as it stands
            panel.marks.append(Box(across, (temperature - high, temperature + high), colour, depth))
    for alpha, colour, label in (
        (0.2, MUTED, f"within {100.0 * _LEVEL:g} % of the curve"),
        *((0.6, *each) for each in _extremes_of(excess)),
    ):
        panel.line([], [], colour, "", marker="s", alpha=alpha, label=label)
    middles = np.degrees([bump.angle for bump in find_bumps(over)])
    if len(middles):
        panel.line(middles, np.full(len(middles), over.temperature[-1]), INK, "", marker="v", label="bump")
    panel.y_limits = (float(over.temperature[0]) - high, float(over.temperature[-1]) + high)
    return panel


def _extremes_of(excess: Float64) -> Iterator[tuple[str, str]]:
    """Yield colour and label of what lies above the curve, and of what lies below."""
    for sign, colour, words in ((1.0, LIMIT, "above"), (-1.0, MEASURED, "below")):
        most = float(np.nanmax(sign * excess, initial=0.0))
        if most >= _LEVEL:
            yield colour, f"{words} the curve, at most {100.0 * most:.1f} %"


def time_traces(series: ReportSeries, results: RunResult) -> Chart:
    """Draw angle, velocity, current and friction over time.

    Phases are a strip, exceedances are shaded and marked.
    """
    strip = Panel("Traces over time", ratio=0.16, bare=True, y_limits=(0.0, 1.0))
    traces = (
        ("angle / deg", np.degrees(series.angle)),
        ("velocity / deg/s", np.degrees(series.velocity)),
        ("current / A", series.current),
        ("friction / N·m", series.friction),
    )
    rows = [Panel(y_label=label, ratio=1.3 if label.startswith("friction") else 1.0) for label, _ in traces]
    chart = Chart(10.4, 6.2, [strip, *rows], "time / s", columns=3)
    for panel, (_, values) in zip(rows, traces, strict=True):
        if len(values) and not np.all(np.isnan(values)):
            panel.line(*broken_at_gaps(*envelope(series.time, values)), MEASURED, width=1.0)
        else:
            panel.empty = "not measured in this run"
    instants = [float(each) for each in series.time[[0, -1]]] if len(series.time) else []
    instants += [p.start_s for p in results.phases] + [p.end_s for p in results.phases if p.end_s is not None]
    if instants and max(instants) > min(instants):
        chart.x_limits = (min(instants), max(instants))
    _phase_strip(strip, rows, results.phases, chart.x_range())
    friction = rows[-1]
    _level(friction, _limit(results, "T_st"), "--", "limit T_st")
    _level(friction, _limit(results, "T_c"), ":", "limit T_c")
    for index, episode in enumerate(results.exceedances):
        for panel in rows:
            panel.marks.append(Box((episode.start_s, episode.end_s), None, LIMIT, 0.22))
        middle = 0.5 * (episode.start_s + episode.end_s)
        name = "exceedance" if index == 0 else None
        peak = math.copysign(episode.peak, episode.velocity or 1.0)  # friction has the direction of the motion
        friction.line([middle], [peak], LIMIT, "", marker="v", size=6.0, label=name)
    return chart


def _medians(angle: Float64, friction: Float64) -> tuple[Float64, Float64]:
    """Return middle angle and median friction of equal segments of angle.

    They are NaN where there is next to nothing.
    """
    edges = np.linspace(angle.min(), angle.max(), _SEGMENTS + 1)
    which = np.clip(np.searchsorted(edges, angle, side="right") - 1, 0, _SEGMENTS - 1)
    parts = [friction[which == k] for k in range(_SEGMENTS)]
    medians = [float(np.median(part)) if len(part) >= _FEWEST else np.nan for part in parts]
    return 0.5 * (edges[1:] + edges[:-1]), np.array(medians)


def _phase_strip(strip: Panel, rows: list[Panel], phases: tuple[Phase, ...], over: tuple[float, float]) -> None:
    start, end = over
    for index, phase in enumerate(phases):
        stop = phase.end_s if phase.end_s is not None else end
        strip.marks.append(Box((phase.start_s, stop), None, MUTED, 0.15 if index % 2 else 0.35))
        for panel in rows:
            panel.marks.append(Rule(phase.start_s, MUTED, is_level=False, style=":", width=0.6))
        share = (stop - phase.start_s) / (end - start)
        name = f"{index + 1} {phase_name(phase)}"
        fits = share * 125 > len(name)  # 125 characters of this size fit across the figure
        label = name if fits else str(index + 1) if share > 0.012 else ""
        strip.marks.append(Text(0.5 * (phase.start_s + stop), 0.45, label))


def _level(panel: Panel, level: float | None, style: str, name: str) -> None:
    if level is not None:
        panel.level(level, LIMIT, style, label=f"{name} {level:.3f} N·m")
        panel.level(-level, LIMIT, style)


def _limit(results: RunResult, measurement_id: str) -> float | None:
    found = results.measurements.get(measurement_id)
    return None if found is None else found.limit_high
