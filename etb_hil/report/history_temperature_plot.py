"""The plot of a history over temperature.

The plot shows friction of each unit, and the law of all of them together.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from etb_hil.histories.history import FRICTION, History, NumberHistory
from etb_hil.histories.temperature import REFERENCE, TemperatureEffect
from etb_hil.recording.samples import Float64
from etb_hil.report.chart import INK, LIMIT, MUTED
from etb_hil.report.drawing import STYLE, legend_below, save_png, say_empty
from etb_hil.report.show import printable
from etb_hil.results.shown import sentence_case

_NAMED = 6  # units that are named; more would hide the data
_MARKERS = "osD^vP"


@mpl.rc_context(STYLE)
def plot_over_temperature(history: History, path: Path) -> bool:
    """Write a PNG of T_st and T_c over temperature, unit by unit, with the law.

    Return False where no law is known.
    """
    numbers = [number for number in history.numbers if number.id in FRICTION]
    if all(number.temperature is None for number in numbers):
        return False
    figure = Figure(figsize=(12.0, 5.0), layout="constrained")
    part = printable(" ".join(filter(None, (history.part_number, history.revision, history.scenario))), 90)
    figure.suptitle(part, fontsize=11, color=INK)
    for place, (axes, number) in enumerate(zip(figure.subplots(1, len(numbers)), numbers, strict=True)):
        _draw(axes, history, number, named=place == 0)
    legend_below(figure, 5)
    save_png(figure, path)
    return True


def _draw(axes: Axes, history: History, number: NumberHistory, *, named: bool) -> None:
    axes.set(xlabel="temperature / °C", ylabel=f"{number.name} / N·m")
    law = number.temperature
    if law is None:
        axes.set_title(f"{sentence_case(number.name)} over temperature")
        say_empty(axes, "no law known: too few runs, or temperatures too close together")
        return
    low, high = 100.0 * law.low, 100.0 * law.high
    axes.set_title(
        f"{sentence_case(number.name)}: {100.0 * law.coefficient:+.2f} %/K (95 %: {low:+.2f} to {high:+.2f})"
    )
    known = [place for place, at in enumerate(number.at) if history.runs[at].temperature is not None]
    warmth = np.array([history.runs[number.at[place]].temperature for place in known], dtype=np.float64)
    values, units = number.values[known], [history.runs[number.at[place]].serial for place in known]
    often = [unit for unit in sorted(set(units), key=lambda unit: (-units.count(unit), unit)) if unit][:_NAMED]
    span = np.linspace(min(float(warmth.min()), REFERENCE), float(warmth.max()), 60)
    for marker, unit in zip(_MARKERS, often, strict=False):
        here = np.array([u == unit for u in units])
        label = printable(unit, 20) if named else None
        (points,) = axes.plot(warmth[here], values[here], marker, markersize=4, label=label)
        axes.plot(span, _law(law, span, _level(law, warmth[here], values[here])), color=points.get_color(), lw=0.8)
    rest = np.array([unit not in often for unit in units])
    if rest.any():
        axes.plot(warmth[rest], values[rest], ".", color=MUTED, label="other units" if named else None, zorder=1)
    middle = _level(law, warmth, values)
    axes.plot(
        span, _law(law, span, middle), color=INK, linewidth=2, label="the law, at all units' mean" if named else None
    )
    weakest, strongest = (middle * np.exp(each * (span - REFERENCE)) for each in (law.low, law.high))
    label = "its 95 % band" if named else None
    axes.fill_between(span, weakest, strongest, color=INK, alpha=0.15, linewidth=0, label=label)
    if number.limit_high is not None:
        label = f"limit, as stated about {REFERENCE:.0f} °C" if named else None
        axes.axhline(number.limit_high, color=LIMIT, linestyle=":", label=label)


def _level(law: TemperatureEffect, warmth: Float64, values: Float64) -> float:
    """Return the mean at 20 degC of values (n) at temperatures (n), by the law."""
    return float(np.exp(np.mean(np.log(values * law.factor(warmth)))))


def _law(law: TemperatureEffect, temperature: Float64, level: float) -> Float64:
    curve: Float64 = level * np.exp(law.coefficient * (temperature - REFERENCE))
    return curve
