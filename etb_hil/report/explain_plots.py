"""The plots of an explanation: a free run of both models, and the residual.

The residual is drawn over angle, speed and so on.
"""

from __future__ import annotations

import math

import numpy as np

from etb_hil.discrepancy.answer.pictures import Pictures, Runs
from etb_hil.discrepancy.answer.residual_curves import ResidualCurve
from etb_hil.report.chart import CLOSING, INK, LIMIT, MEASURED, MUTED, OPENING, Chart, Panel


def before_and_after(series: Pictures) -> Chart:
    """Draw the segment with the largest error, simulated from the voltage alone."""
    what, (times, unit) = "position" if series.position_unit == "m" else "angle", _shown(series.position_unit)
    measured, before = times * series.measured, times * series.before
    upper = Panel(series.title, f"{what} / {unit}", ratio=2.0)
    upper.line(series.time, measured, INK, label="measured")
    upper.line(series.time, before, LIMIT, "--", label=series.before_is)
    lower = Panel(y_label=f"error / {unit}")
    lower.line(series.time, before - measured, LIMIT, "--")
    if series.after is not None:
        after = times * series.after
        upper.line(series.time, after, MEASURED, ":", width=1.8, label=series.after_is)
        lower.line(series.time, after - measured, MEASURED)
    return Chart(9.0, 4.6, [upper, lower], "time / s", columns=3)


def over_runs(runs: Runs) -> Chart:
    """Draw how well each run was predicted over what was set.

    The plot shows where the plate broke away, if it did.
    """
    broke_away = bool(np.isfinite([runs.breaks_away, runs.model_breaks_away]).any())
    panels = [Panel(f"Free runs over {runs.condition}", "R²")]
    unseen = ~runs.is_seen
    panels[0].line(runs.value[unseen], runs.r_squared[unseen], MEASURED, "", marker="o", label="not used in the fit")
    panels[0].line(
        runs.value[runs.is_seen], runs.r_squared[runs.is_seen], MUTED, "", marker="s", label="used in the fit"
    )
    if broke_away:
        panels.append(Panel(y_label="breaks away at / V"))
        panels[1].line(runs.value, runs.breaks_away, INK, marker="o", label="measured")
        panels[1].line(runs.value, runs.model_breaks_away, LIMIT, "--", marker="x", label="calibrated model")
    x_label = f"{runs.condition} / {runs.unit}" if runs.unit else runs.condition
    return Chart(9.0, 4.6 if broke_away else 2.8, panels, x_label, columns=4)


def residual_plot(left: ResidualCurve) -> Chart:
    """Draw the residual of a balance over a coordinate, by direction.

    The residual is that of the calibrated and of the extended model.
    """
    (times, unit), (along, over_unit) = _shown(left.unit), _shown(left.over_unit)
    over = left.over.replace("_", " ")
    panels = []
    for number, (forward, back) in enumerate(zip(left.forward, left.back, strict=True)):
        name = ("calibrated model", "extended model")[number]
        panel = Panel(f"{left.balance.capitalize()} residual over {over}, {name}", f"residual / {unit}")
        panel.level(0.0, MUTED, width=0.8)
        panel.line(along * left.place, times * forward, OPENING, label="forward" if number == 0 else None)
        panel.line(along * left.place, times * back, CLOSING, "--", label="back" if number == 0 else None)
        panels.append(panel)
    panels[-1].y_limits = panels[0].y_range()
    return Chart(9.0, 2.3 * len(panels), panels, f"{over} / {over_unit}", columns=2)


def _shown(unit: str) -> tuple[float, str]:
    """Return the factor from SI to the unit that people read, and that unit."""
    return (math.degrees(1.0), unit.replace("rad", "deg")) if unit.startswith("rad") else (1.0, unit)
