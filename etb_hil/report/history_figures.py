"""The figures of a history's page.

A measurement over time, its control chart, and its distribution with the limits.
"""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from etb_hil.histories.history import History, NumberHistory
from etb_hil.report.chart import CLOSING, INK, MEASURED
from etb_hil.report.drawing import STYLE, legend_below, new_figure
from etb_hil.report.history_plot import at_temperature, draw_chart, draw_limits, draw_over_time, label_of

_LEGEND_COLUMN = 1.6  # inches: a label of 20 characters


@mpl.rc_context(STYLE)
def over_time(history: History, number: NumberHistory, width_in: float) -> Figure:
    """Draw each value at its time, with the limits.

    The axis is as long as the runs, an hour at the least.
    """
    figure, (axes,) = new_figure(width_in, 3.4)
    draw_over_time(axes, history, number, named=True)
    axes.set(title="By unit" + at_temperature(number), xlabel="time (UTC)")
    legend_below(figure, int(width_in / _LEGEND_COLUMN))
    return figure


@mpl.rc_context(STYLE)
def chart(number: NumberHistory) -> Figure:
    """Draw the control chart with EWMA, and the moving ranges under it."""
    figure, (values, ranges) = new_figure(5.2, 4.6, 2, [2.2, 1.0])
    draw_chart(values, ranges, number, named=True)
    values.set(title="Control chart")
    legend_below(figure, 3)
    return figure


@mpl.rc_context(STYLE)
def spread(number: NumberHistory) -> Figure:
    """Draw how many units have which value, with quantiles and limits.

    The capability rests on these quantiles.
    """
    figure, (axes,) = new_figure(5.2, 4.6)
    values = number.chart.values if number.chart is not None else np.empty(0)
    axes.set(title="Distribution", xlabel=label_of(number), ylabel="units")
    axes.hist(values, bins="auto" if np.ptp(values) > 0.0 else 1, color=MEASURED, alpha=0.7)
    if number.shape is not None:
        shape = number.shape
        name = f"0.135, 50, 99.865 % ({shape.family})"
        for at, label in ((shape.low, name), (shape.median, None), (shape.high, None)):
            axes.axvline(at, color=CLOSING, linestyle="--", label=label)
    if number.tolerance_limit is not None:
        axes.axvline(number.tolerance_limit, color=INK, linestyle="-.", label="99 % of units below, 95 % confidence")
    draw_limits(axes.axvline, number, "limit")
    legend_below(figure, 2)
    return figure
