"""A picture of any Recording: a run of the bench, a vehicle's log, a table from another rig."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from etb_hil.base.errors import InputError
from etb_hil.base.roles import ROLES
from etb_hil.recording.recording import Recording, Series
from etb_hil.recording.samples import Float64
from etb_hil.report.drawing import (
    LIMIT,
    MEASURED,
    STYLE,
    broken_at_gaps,
    envelope,
    legend_below,
    new_figure,
    save_png,
    say_empty,
)

_NS = 1e-9
_LONGEST_TITLE = 90
_TALL, _FLAT = 1.7, 0.7  # inches of a role that moves, and of one that never does
_CLOCKS = {"sample_counter", "controller_time"}


def plot_recording(recording: Recording, roles: Sequence[str], path: Path) -> None:
    """Write `figure_of` a recording as PNG; InputError where it cannot be written."""
    save_png(figure_of(recording, roles), path)


@mpl.rc_context(STYLE)
def figure_of(recording: Recording, roles: Sequence[str]) -> Figure:
    """Draw one plot a role over time, gaps shaded; angles in degrees, shares in per cent.

    Raises InputError where the recording has no signal for a role, naming those it has, or where no role is given.
    """
    if not roles:
        raise InputError("no role to plot was given; allowed: " + ", ".join(recording.roles))
    signals = [recording.series(role) for role in roles]
    begins = [int(signal.time_ns[0]) for signal in signals if len(signal.time_ns)]
    start_ns = min(begins, default=0)
    shown = [_shown(signal) for signal in signals]
    heights = [_FLAT if _is_flat(values) else _TALL for values, _ in shown]
    figure, rows = new_figure(10.4, 1.2 + sum(heights), rows=len(signals), ratios=heights)
    title = f"{Path(recording.origin).name} ({recording.clock.value})"  # no one's folders in a picture
    rows[0].set_title(title if len(title) <= _LONGEST_TITLE else "..." + title[-_LONGEST_TITLE:])
    rows[-1].set_xlabel("time / s")
    for axes, signal, (values, unit) in zip(rows, signals, shown, strict=True):
        name = signal.role.replace("_", " ")
        axes.set_ylabel(f"{name}\n/ {unit}" if unit else name, rotation=0, ha="right", va="center")
        if not np.any(np.isfinite(values)):
            say_empty(axes, "no good sample")
            continue
        time = (signal.time_ns - start_ns).astype(np.float64) * _NS
        axes.plot(*broken_at_gaps(*envelope(time, values)), color=MEASURED, linewidth=1.0)
        if _is_flat(values):
            axes.set_yticks([float(np.nanmin(values))])
    figure.align_ylabels(rows)
    first = True
    for gap in recording.gaps():
        span = ((gap.start_ns - start_ns) * _NS, (gap.end_ns - start_ns) * _NS)
        for axes in rows:
            axes.axvspan(*span, color=LIMIT, alpha=0.25, label="samples missing" if first else None)
            first = False
    legend_below(figure, 1)
    return figure


def worth_showing(recording: Recording) -> list[str]:
    """Return the roles that say something over time: no counters and clocks, nothing that was there once."""
    return [role for role in recording.roles if role not in _CLOCKS and len(recording.series(role).values) > 1]


def range_text(signal: Series) -> str:
    """Return in a line how many samples a role has and where they lie, in the unit that people read them in."""
    values, unit = _shown(signal)
    good = values[np.isfinite(values)]
    span = f"{good.min():.4g} to {good.max():.4g} {unit}".rstrip() if len(good) else "no good sample"
    seconds = (int(signal.time_ns[-1]) - int(signal.time_ns[0])) * _NS if len(signal.time_ns) else 0.0
    return f"{signal.role:20} {len(values):8} samples in {seconds:.1f} s, {span}"


def _is_flat(values: Float64) -> bool:
    return not np.any(np.isfinite(values)) or bool(np.nanmin(values) == np.nanmax(values))


def _shown(signal: Series) -> tuple[Float64, str]:
    """Return the values in the unit that people read them in."""
    if signal.role == "engine_speed":
        return signal.values * (30.0 / math.pi), "rpm"
    if signal.unit in {"rad", "rad/s"}:
        return np.degrees(signal.values).astype(np.float64), signal.unit.replace("rad", "deg")
    if signal.unit == "degC":
        return signal.values, "°C"
    if signal.role in {"pedal_position", "throttle_opening", "motor_duty", "command_duty"}:
        return signal.values * 100.0, "%"
    if ROLES[signal.role].unit == "1":
        return signal.values, ""
    return signal.values, signal.unit
