"""A picture of any Recording: a run of the bench, a vehicle's log, a table from another rig."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np

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


@mpl.rc_context(STYLE)
def plot_recording(recording: Recording, roles: Sequence[str], path: Path) -> None:
    """Write a PNG with one plot a role over time, gaps shaded; angles in degrees, shares in per cent.

    Raises InputError where the recording has no signal for a role, naming those it has, or where no role is given.
    """
    if not roles:
        raise InputError("no role to plot was given; allowed: " + ", ".join(recording.roles))
    signals = [recording.series(role) for role in roles]
    begins = [int(signal.time_ns[0]) for signal in signals if len(signal.time_ns)]
    start_ns = min(begins, default=0)
    figure, rows = new_figure(10.4, 1.2 + 1.7 * len(signals), rows=len(signals))
    title = f"{Path(recording.origin).name} ({recording.clock.value})"  # no one's folders in a picture
    rows[0].set_title(title if len(title) <= _LONGEST_TITLE else "..." + title[-_LONGEST_TITLE:])
    rows[-1].set_xlabel("time / s")
    for axes, signal in zip(rows, signals, strict=True):
        values, unit = _shown(signal)
        axes.set_ylabel(f"{signal.role.replace('_', ' ')}\n/ {unit}" if unit else signal.role.replace("_", " "))
        if not np.any(np.isfinite(values)):
            say_empty(axes, "no good sample")
            continue
        time = (signal.time_ns - start_ns).astype(np.float64) * _NS
        axes.plot(*broken_at_gaps(*envelope(time, values)), color=MEASURED, linewidth=1.0)
    figure.align_ylabels(rows)
    first = True
    for gap in recording.gaps():
        span = ((gap.start_ns - start_ns) * _NS, (gap.end_ns - start_ns) * _NS)
        for axes in rows:
            axes.axvspan(*span, color=LIMIT, alpha=0.25, label="samples missing" if first else None)
            first = False
    legend_below(figure, 1)
    save_png(figure, path)


def _shown(signal: Series) -> tuple[Float64, str]:
    """Return the values in the unit that people read them in."""
    if signal.unit == "rad":
        return np.degrees(signal.values).astype(np.float64), "deg"
    if signal.unit == "degC":
        return signal.values, "°C"
    if signal.role in {"pedal_position", "throttle_opening", "motor_duty", "command_duty"}:
        return signal.values * 100.0, "%"
    if ROLES[signal.role].unit == "1":
        return signal.values, ""
    return signal.values, signal.unit
