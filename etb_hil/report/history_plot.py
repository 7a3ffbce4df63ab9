"""The plot of a history: friction of each unit over time, and the control charts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from textwrap import fill
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure

from etb_hil.histories.control_chart import FEWEST, ControlChart
from etb_hil.histories.history import FRICTION, History, NumberHistory
from etb_hil.histories.temperature import REFERENCE
from etb_hil.recording.samples import Int64
from etb_hil.report.chart import CLOSING, INK, LIMIT, MEASURED, MUTED, OPENING
from etb_hil.report.drawing import STYLE, legend_below, save_png, say_empty
from etb_hil.report.show import printable
from etb_hil.results.shown import factor, sentence_case, unit_shown

_LABEL = 32  # characters of a line along an axis
_NAMED = 8  # units that are named; more would hide the data
_MARKERS = "osD^vPX*"
_COLOURS = (MEASURED, OPENING, CLOSING)
_SHORTEST = timedelta(hours=1)  # of the time axis; of a single run it would be years


@mpl.rc_context(STYLE)
def plot_history(history: History, path: Path) -> None:
    """Write a PNG of each unit's measurements over time, and control charts.

    Limits are drawn, too.
    """
    names = [in_units_shown(number) for number in history.numbers if number.at or number.id in FRICTION]
    figure = Figure(figsize=(12.0, 4.4 * len(names)), layout="constrained")
    layout: list[Any] = [
        row for n in names for row in ([f"{n.id} time", f"{n.id} chart"],) * 2 + ([f"{n.id} time", f"{n.id} range"],)
    ]
    axes = figure.subplot_mosaic(layout)
    part = printable(" ".join(filter(None, (history.part_number, history.revision, history.scenario))), 90)
    figure.suptitle(part, fontsize=11, color=INK)
    for place, number in enumerate(names):
        draw_over_time(axes[f"{number.id} time"], history, number, named=place == 0)
        axes[f"{number.id} time"].set(title=sentence_case(number.name) + at_temperature(number))
        draw_chart(axes[f"{number.id} chart"], axes[f"{number.id} range"], number, named=place == 0)
    legend_below(figure, 5)
    save_png(figure, path)


def draw_over_time(axes: Axes, history: History, number: NumberHistory, *, named: bool) -> None:
    """Draw each value of a measurement at its time.

    Units that were often tested have marks of their own.
    """
    axes.set(ylabel=label_of(number))
    if not number.at:
        say_empty(axes, "no run counts")
        return
    when = np.array([history.runs[k].at for k in number.at])
    units = [history.runs[k].serial for k in number.at]
    again = [(unit, count) for unit, count in Counter(units).items() if count > 1]
    often = [unit for unit, _ in sorted(again, key=lambda each: (not each[0], -each[1], each[0]))[:_NAMED]]
    rest = np.array([unit not in often for unit in units])
    for place, (marker, unit) in enumerate(zip(_MARKERS, often, strict=False)):
        here = np.array([u == unit for u in units])
        label = (printable(unit, 20) or "no serial number") if named else None
        axes.plot(
            when[here],
            number.compared[here],
            f"{marker}-" if unit else marker,
            color=_COLOURS[place % len(_COLOURS)],
            markersize=4,
            linewidth=0.8,
            label=label,
        )
    if rest.any():
        axes.plot(when[rest], number.compared[rest], ".", color=MUTED, label="other units" if named else None)
    draw_limits(axes.axhline, number, "limit" if named else None)
    if when.max() - when.min() < _SHORTEST:
        middle = when.min() + 0.5 * (when.max() - when.min())
        axes.set_xlim(middle - 0.5 * _SHORTEST, middle + 0.5 * _SHORTEST)
    locator = AutoDateLocator()  # type: ignore[no-untyped-call]
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))  # type: ignore[no-untyped-call]


def label_of(number: NumberHistory) -> str:
    """Return what an axis of a measurement is called."""
    return fill(f"{number.name} / {number.unit}" if number.unit else number.name, _LABEL)


def at_temperature(number: NumberHistory) -> str:
    """Return where values are drawn without temperature, behind the title of a plot."""
    return "" if number.temperature is None else f" at {REFERENCE:.0f} °C"


def in_units_shown(number: NumberHistory) -> NumberHistory:
    """Return a history in the unit that people read, such as degrees, for its plots."""
    by, chart, shape = factor(number.unit), number.chart, number.shape
    return replace(
        number,
        unit=unit_shown(number.unit),
        compared=by * number.compared,
        chart=chart
        and replace(
            chart,
            values=by * chart.values,
            ranges=by * chart.ranges,
            centre=by * chart.centre,
            sigma=by * chart.sigma,
            least=by * chart.least,
        ),
        shape=shape and replace(shape, low=by * shape.low, median=by * shape.median, high=by * shape.high),
        limit_low=None if number.limit_low is None else by * number.limit_low,
        limit_high=None if number.limit_high is None else by * number.limit_high,
    )


def draw_chart(values: Axes, ranges: Axes, number: NumberHistory, *, named: bool) -> None:
    """Draw the control chart of a measurement, and its moving ranges."""
    values.set(title="Control chart, a point a unit", ylabel=label_of(number))
    values.sharex(ranges)
    values.tick_params(labelbottom=False)
    ranges.set(xlabel="units in order of their latest runs", ylabel="moving range")
    chart = number.chart
    if chart is None:
        say_empty(values, f"units so far: {len(number.charted)} of the {FEWEST} that limits need")
        say_empty(ranges, "")
        ranges.set(xticks=[])
        return
    place = np.arange(1, len(chart.values) + 1)
    values.plot(place, chart.values, "o-", color=MEASURED, markersize=3.5, linewidth=0.8)
    _lines(values, chart, named=named)
    _ewma(values, place, chart, named=named)
    beyond = sorted({*chart.signals, *chart.shifts.signals})
    values.plot(
        place[beyond],
        chart.values[beyond],
        "s",
        color=LIMIT,
        markersize=7,
        fillstyle="none",
        label="signal" if named else None,
    )
    ranges.plot(place[1:], chart.ranges, "o-", color=MEASURED, markersize=3, linewidth=0.8)
    ranges.axhline(chart.mean_range, color=INK, linewidth=0.8)
    ranges.axhline(chart.range_high, color=INK, linestyle="--", linewidth=0.8)


def _ewma(axes: Axes, place: Int64, chart: ControlChart, *, named: bool) -> None:
    mean, reach = (chart.centre + chart.sigma * each for each in (chart.shifts.mean, chart.shifts.reach))
    axes.plot(place, mean, "-", color=CLOSING, linewidth=1.6, label="EWMA and its limits" if named else None)
    for limit in (reach, 2.0 * chart.centre - reach):
        axes.plot(place, limit, "-.", color=CLOSING, linewidth=0.7)


def _lines(axes: Axes, chart: ControlChart, *, named: bool) -> None:
    axes.axhline(chart.centre, color=INK, linewidth=0.8, label="centre" if named else None)
    axes.axhline(chart.low, color=INK, linestyle="--", linewidth=0.8, label="control limits" if named else None)
    axes.axhline(chart.high, color=INK, linestyle="--", linewidth=0.8)


def draw_limits(line: Callable[..., object], number: NumberHistory, label: str | None) -> None:
    """Draw the limits of a measurement by an axes' own `line` across it or along."""
    for limit in (number.limit_low, number.limit_high):
        if limit is not None:
            line(limit, color=LIMIT, linestyle=":", label=label)
            label = None
