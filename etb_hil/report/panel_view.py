"""Layout of the live panel.

The panel has 80 columns and fewer than 24 rows, and is readable without colour.
"""

from __future__ import annotations

import math

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from etb_hil.report import show
from etb_hil.report.panel_feed import PanelSnapshot
from etb_hil.results import shown

WIDTH = 80
_BAR = 20
_WIDE_BAR = 40
_NEAR = 0.85  # share of a limit from which a value is drawn as near it
_SILENT_S = 2.0
_QUESTION = 296  # characters: four rows


def draw(snapshot: PanelSnapshot, silent_s: float = 0.0) -> RenderableType:
    """Return the panel of a snapshot; `silent_s` is how long ago it came."""
    parts: list[RenderableType] = [_progress(snapshot), Text(), _measured(snapshot), Text(), _friction(snapshot)]
    parts += [Text(), _line(_bus(snapshot))]
    if silent_s > _SILENT_S:
        parts.append(_line(f"nothing heard from the run for {silent_s:.0f} s", "bold"))
    if snapshot.question:
        parts.append(Text("? " + show.printable(snapshot.question, _QUESTION), "bold"))
    else:
        parts += [_line("> " + show.printable(message)) for message in snapshot.messages]
    if snapshot.before:
        parts.append(_line(show.printable(snapshot.before)))
    if snapshot.keys:
        parts.append(_line("keys: " + show.printable(snapshot.keys)))
    title = Text(show.printable(snapshot.title, 70))
    return Panel(Group(*parts), title=title, title_align="left", width=WIDTH, padding=(0, 1))


def progress_line(snapshot: PanelSnapshot) -> str:
    """Return a snapshot as one line for a log file."""
    parts = [
        f"{snapshot.time_s:8.1f} s",
        show.printable(snapshot.phase, 40),
        "" if snapshot.progress is None else f"{100.0 * snapshot.progress:.0f} %",
        f"angle {shown.quantity(snapshot.angle, 'rad')}",
        f"friction {shown.quantity(snapshot.friction, 'N·m')}",
        f"T_st {shown.quantity(snapshot.stiction, 'N·m')}",
        f"T_c {shown.quantity(snapshot.coulomb, 'N·m')}",
        _bus(snapshot),
    ]
    return "  ".join(part for part in parts if part)


def bar(value: float, width: int) -> str:
    """Return a bar of `width` characters that is full at 1."""
    full = round(min(max(value, 0.0), 1.0) * width)
    return "#" * full + "." * (width - full)


def _progress(snapshot: PanelSnapshot) -> Text:
    first = f"phase  {show.printable(snapshot.phase, 60) or shown.UNKNOWN}\n"
    done = shown.UNKNOWN if snapshot.progress is None else f"{100.0 * snapshot.progress:3.0f} %"
    left = "" if snapshot.time_left_s is None else f"   {_clock(snapshot.time_left_s)} left"
    second = f"[{bar(snapshot.progress or 0.0, _WIDE_BAR)}] {done}   {snapshot.time_s:.1f} s{left}"
    return _line(first + second)


def _measured(snapshot: PanelSnapshot) -> Table:
    table = _grid(19, 13, 14, 16)
    table.add_row(Text("angle"), _value(snapshot.angle, "rad"), Text("velocity"), _value(snapshot.velocity, "rad/s"))
    table.add_row(
        Text("current"), _value(snapshot.current, "A"), Text("temperature"), _value(snapshot.temperature, "degC")
    )
    return table


def _friction(snapshot: PanelSnapshot) -> Table:
    table = _grid(19, 10, 15, _BAR + 8)
    for name, value, limit in (
        ("friction", snapshot.friction, snapshot.friction_limit),
        ("break-away friction", snapshot.stiction, snapshot.stiction_limit),
        ("sliding friction", snapshot.coulomb, snapshot.coulomb_limit),
    ):
        table.add_row(Text(name), _value(value, "N·m"), Text(_limit(limit)), _against(value, limit))
    count = shown.UNKNOWN if snapshot.exceedances is None else str(snapshot.exceedances)
    table.add_row(Text("exceedances"), Text(count))
    return table


def _against(value: float | None, limit: float | None) -> Text:
    """Return a bar of a value against its limit; a word says what the colour says."""
    if value is None or limit is None or limit <= 0.0 or not math.isfinite(value):
        return Text()
    used = abs(value) / limit
    style = "bold red" if used > 1.0 else "yellow" if used > _NEAR else "green"
    return Text(f"[{bar(used, _BAR)}] {'OVER' if used > 1.0 else f'{100.0 * used:3.0f} %'}", style)


def _bus(snapshot: PanelSnapshot) -> str:
    lost = shown.UNKNOWN if snapshot.lost is None else str(snapshot.lost)
    return f"bus load {show.share(snapshot.load)}  lost frames {lost}"


def _limit(limit: float | None) -> str:
    return "" if limit is None else f"limit {shown.quantity(limit, 'N·m')}"


def _value(value: float | None, unit: str) -> Text:
    return Text(shown.quantity(value, unit), "bold")


def _line(text: str, style: str = "") -> Text:
    return Text(text, style, no_wrap=True, overflow="ellipsis")


def _grid(*widths: int) -> Table:
    table = Table.grid(padding=(0, 1))
    for width in widths:
        table.add_column(width=width, no_wrap=True, overflow="ellipsis")
    return table


def _clock(seconds: float) -> str:
    whole = max(0, round(seconds))
    return f"{whole // 60}:{whole % 60:02d}"
