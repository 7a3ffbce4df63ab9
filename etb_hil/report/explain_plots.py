"""The plots of an explanation: a free run of both models, and the residual over angle, speed and so on."""

from __future__ import annotations

import math

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from etb_hil.discrepancy.answer.pictures import Pictures, Runs
from etb_hil.discrepancy.answer.residual_curves import ResidualCurve
from etb_hil.report.drawing import CLOSING, INK, LIMIT, MEASURED, MUTED, OPENING, STYLE, legend_below, new_figure


@mpl.rc_context(STYLE)
def before_and_after(series: Pictures) -> Figure:
    """Draw the segment with the largest error, simulated from the measured voltage alone."""
    figure, (upper, lower) = new_figure(9.0, 4.6, 2, [2.0, 1.0])
    what, (times, unit) = "position" if series.position_unit == "m" else "angle", _shown(series.position_unit)
    measured, before = times * series.measured, times * series.before
    upper.set(title=series.title, ylabel=f"{what} / {unit}")
    upper.plot(series.time, measured, color=INK, label="measured")
    upper.plot(series.time, before, "--", color=LIMIT, label=series.before_is)
    lower.set(xlabel="time / s", ylabel=f"error / {unit}")
    lower.plot(series.time, before - measured, "--", color=LIMIT)
    if series.after is not None:
        after = times * series.after
        upper.plot(series.time, after, ":", color=MEASURED, linewidth=1.8, label=series.after_is)
        lower.plot(series.time, after - measured, color=MEASURED)
    legend_below(figure, 3)
    return figure


@mpl.rc_context(STYLE)
def over_runs(runs: Runs) -> Figure:
    """Draw how well each run was predicted, and where the plate broke away if it did, over what was set."""
    broke_away = bool(np.isfinite([runs.breaks_away, runs.model_breaks_away]).any())
    figure, plots = new_figure(9.0, 4.6, 2) if broke_away else new_figure(9.0, 2.8, 1)
    upper = plots[0]
    upper.set(title=f"Free runs over {runs.condition}", ylabel="R²")
    unseen = ~runs.is_seen
    upper.plot(runs.value[unseen], runs.r_squared[unseen], "o", color=MEASURED, label="not used in the fit")
    upper.plot(runs.value[runs.is_seen], runs.r_squared[runs.is_seen], "s", color=MUTED, label="used in the fit")
    if broke_away:
        plots[1].set(ylabel="breaks away at / V")
        plots[1].plot(runs.value, runs.breaks_away, "o-", color=INK, label="measured")
        plots[1].plot(runs.value, runs.model_breaks_away, "x--", color=LIMIT, label="calibrated model")
    plots[-1].set_xlabel(f"{runs.condition} / {runs.unit}" if runs.unit else runs.condition)
    legend_below(figure, 4)
    return figure


@mpl.rc_context(STYLE)
def left_over(left: ResidualCurve) -> Figure:
    """Draw the residual of a balance over a coordinate, by direction, of the calibrated and of the extended model."""
    count = len(left.forward)
    figure, plots = new_figure(9.0, 2.3 * count, count)
    (times, unit), (along, over_unit) = _shown(left.unit), _shown(left.over_unit)
    over = left.over.replace("_", " ")
    for number, (axes, name) in enumerate(zip(plots, ("calibrated model", "extended model"), strict=False)):
        forward, back = times * left.forward[number], times * left.back[number]
        axes.set(title=f"{left.balance.capitalize()} residual over {over}, {name}", ylabel=f"residual / {unit}")
        axes.axhline(0.0, color=MUTED, linewidth=0.8)
        axes.plot(along * left.place, forward, "-", color=OPENING, label="forward" if number == 0 else None)
        axes.plot(along * left.place, back, "--", color=CLOSING, label="back" if number == 0 else None)
    plots[-1].set_ylim(*plots[0].get_ylim())
    plots[-1].set_xlabel(f"{over} / {over_unit}")
    legend_below(figure, 2)
    return figure


def _shown(unit: str) -> tuple[float, str]:
    """Return what values in SI are multiplied by where people read them, and the unit that they then have."""
    return (math.degrees(1.0), unit.replace("rad", "deg")) if unit.startswith("rad") else (1.0, unit)
