"""A picture of any Recording.

A run of the bench, a vehicle's log, a table from another rig.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.files import write_text
from etb_hil.base.roles import ROLES
from etb_hil.recording.recording import Recording, Series
from etb_hil.recording.samples import Float64
from etb_hil.report.chart import LIMIT, MEASURED, Box, Chart, Panel
from etb_hil.report.reduction import broken_at_gaps, envelope
from etb_hil.report.svg import svg_of

_NS = 1e-9
_LONGEST_TITLE = 90
_TALL, _FLAT = 1.7, 0.7  # inches of a role that moves, and of one that never does
_CLOCKS = {"sample_counter", "controller_time"}


def plot_recording(recording: Recording, roles: Sequence[str], path: Path) -> None:
    """Write `chart_of` a recording as `.svg` or `.png`.

    InputError where it cannot be written.
    """
    chart = chart_of(recording, roles)
    if path.suffix.lower() == ".svg":
        write_text(path, svg_of(chart, "plot") + "\n")
    elif path.suffix.lower() == ".png":
        from etb_hil.report.drawing import figure_of, save_png  # noqa: PLC0415 (matplotlib takes its time to load)

        save_png(figure_of(chart), path)
    else:
        raise InputError(Problem("must have a suffix of a picture", Place(path), path.suffix, ".svg, .png"))


def chart_of(recording: Recording, roles: Sequence[str]) -> Chart:
    """Draw one plot a role over time, gaps shaded.

    Angles are in degrees, shares in per cent.

    Raises InputError where the recording has no signal for a role, naming those it has, or where no role is given.
    """
    if not roles:
        raise InputError("no role to plot was given; allowed: " + ", ".join(recording.roles))
    signals = [recording.series(role) for role in roles]
    begins = [int(signal.time_ns[0]) for signal in signals if len(signal.time_ns)]
    start_ns = min(begins, default=0)
    panels = [_panel(signal, start_ns) for signal in signals]
    title = f"{Path(recording.origin).name} ({recording.clock.value})"  # no one's folders in a picture
    panels[0].title = title if len(title) <= _LONGEST_TITLE else "..." + title[-_LONGEST_TITLE:]
    for number, gap in enumerate(recording.gaps()):
        span = ((gap.start_ns - start_ns) * _NS, (gap.end_ns - start_ns) * _NS)
        for panel in panels:
            is_first = number == 0 and panel is panels[0]
            panel.marks.append(Box(span, None, LIMIT, 0.25, "samples missing" if is_first else None))
    return Chart(10.4, 1.2 + sum(panel.ratio for panel in panels), panels, "time / s")


def _panel(signal: Series, start_ns: int) -> Panel:
    """Return the plot of one role; its height in inches is its ratio."""
    values, unit = _shown(signal)
    name = signal.role.replace("_", " ")
    label = f"{name}\n/ {unit}" if unit else name
    panel = Panel(y_label=label, ratio=_FLAT if _is_flat(values) else _TALL, upright_label=True)
    if not np.any(np.isfinite(values)):
        panel.empty = "no good sample"
        return panel
    time = (signal.time_ns - start_ns).astype(np.float64) * _NS
    panel.line(*broken_at_gaps(*envelope(time, values)), MEASURED, width=1.0)
    if _is_flat(values):
        panel.y_ticks = [float(np.nanmin(values))]
    return panel


def worth_showing(recording: Recording) -> list[str]:
    """Return the roles that say something over time.

    Counters and clocks are left out, and what was there once.
    """
    return [role for role in recording.roles if role not in _CLOCKS and len(recording.series(role).values) > 1]


def range_text(signal: Series) -> str:
    """Return in a line how many samples a role has, and their range.

    The range is in the unit that people read.
    """
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
