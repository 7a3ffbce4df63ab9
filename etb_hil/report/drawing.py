"""How every plot of the project looks, and how it becomes a PNG file and an SVG that follows light and dark."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import escape
from matplotlib.axes import Axes
from matplotlib.backend_bases import get_registered_canvas_class
from matplotlib.dates import ConciseDateFormatter
from matplotlib.figure import Figure

from etb_hil.base.files import replacing
from etb_hil.recording.samples import Float64, Int64

# Okabe and Ito's colours, distinguished with any colour vision; what a colour says, a line style or a marker says
# again.
INK, MUTED, GRID, PAPER = "#1b1f24", "#5c6670", "#d5dae0", "#fdfefe"
MEASURED, OPENING, CLOSING, LIMIT = "#0072b2", "#00765a", "#a8479a", "#d55e00"

# The variables that a page sets to make an SVG follow its light or dark colours.
_VARIABLES = {
    INK: "--plot-ink",
    MUTED: "--plot-muted",
    GRID: "--plot-grid",
    PAPER: "--plot-paper",
    MEASURED: "--plot-measured",
    OPENING: "--plot-opening",
    CLOSING: "--plot-closing",
    LIMIT: "--plot-limit",
}

# Matplotlib reads some of these when a plot is made and others when it is written: `@mpl.rc_context(STYLE)` on both.
STYLE: dict[Any, Any] = {  # Any: matplotlib spells the keys out as a type of a thousand words
    "font.family": ["DejaVu Sans"],
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.facecolor": PAPER,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "figure.facecolor": PAPER,
    "text.color": INK,
    "text.parse_math": False,  # a name in somebody's file may hold a dollar sign
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "lines.linewidth": 1.3,
    "svg.fonttype": "none",  # text stays text: small, searchable, read out by screen readers
    "axes.unicode_minus": True,
}

_PLOT = "plot-"
_MARKS = re.compile(r'<g clip-path="(?P<clip>[^"]*)">(?P<marks>(?:\s*<use [^>]*/>)+)\s*</g>')
_MANY, _DOT = 20, 2.2  # marks, and their diameter in points
PNG_DPI = 160
_SVG_DPI = 72  # its unit is the point
COLUMNS = 1400


@mpl.rc_context(STYLE)
def new_figure(
    width_in: float, height_in: float, rows: int = 1, ratios: list[float] | None = None
) -> tuple[Figure, list[Axes]]:
    """Return a figure with `rows` plots above each other that share their x axis; no global state is touched."""
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    grid = figure.subplots(rows, 1, sharex=True, squeeze=False, height_ratios=ratios)
    return figure, list(grid[:, 0])


@mpl.rc_context(STYLE)
def save_png(figure: Figure, path: Path) -> None:
    """Write a figure as PNG, whole or not at all; InputError where it cannot be written."""
    with replacing(path) as part, _laid_out(figure, "png", PNG_DPI):
        figure.savefig(part, format="png", dpi=PNG_DPI)


@contextmanager
def _laid_out(figure: Figure, form: str, dpi: float) -> Iterator[None]:
    """Place a figure's plots as they will be in a file, so that `savefig` does not draw everything twice for that."""
    engine = figure.get_layout_engine()
    if engine is None:
        yield
        return
    own = figure.canvas, figure.dpi
    get_registered_canvas_class(form)(figure)
    figure.dpi = dpi
    try:
        engine.execute(figure)
        figure.set_layout_engine(None)
        yield
    finally:
        figure.set_layout_engine(engine)
        figure.dpi = own[1]
        figure.set_canvas(own[0])


def inline_svg(figure: Figure, name: str) -> str:
    """Return a figure as an `<svg>` element for a page; `name` keeps its ids apart from those of other figures.

    Each plot's group carries its frame and its ranges (`data-box`, `data-x`, `data-y`), by which `zoom.js` works.
    """
    for number, axes in enumerate(figure.axes):
        axes.set_gid(f"{_PLOT}{number}")
    text = io.StringIO()
    with mpl.rc_context(STYLE), _laid_out(figure, "svg", _SVG_DPI):
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    svg = text.getvalue()
    svg = _as_dots(svg[svg.index("<svg") :])
    for number, axes in enumerate(figure.axes):
        svg = svg.replace(f'id="{_PLOT}{number}"', f'id="{_PLOT}{number}" {_scales(axes)}')
    # matplotlib numbers some ids by where they lie in memory; all of them repeat in the next figure of a page
    hashed = {given: f"id-{k}" for k, given in enumerate(dict.fromkeys(re.findall(r'\bid="([a-z][0-9a-f]{10})"', svg)))}
    svg = re.sub(
        r'(\bid="|href="#|url\(#)([^")]*)', lambda found: f"{found[1]}{name}-{hashed.get(found[2], found[2])}", svg
    )
    svg = re.sub(r'(<svg [^>]*?) (?:width|height)="[^"]*"', r"\1", svg, count=1)
    svg = re.sub(r'(<svg [^>]*?) (?:width|height)="[^"]*"', r'\1 role="img"', svg, count=1)
    for colour, variable in _VARIABLES.items():
        svg = svg.replace(colour, f"var({variable}, {colour})")
    return svg


def _scales(axes: Axes) -> str:
    """Return a plot's frame in the drawing, from the top left in points, and the values at its edges."""
    figure = axes.get_figure()
    width, height = 72.0 * figure.get_size_inches()  # type: ignore[union-attr]
    frame = axes.get_position()
    box = (frame.x0 * width, (1.0 - frame.y1) * height, frame.width * width, frame.height * height)
    values = {"box": box, "x": axes.get_xlim(), "y": axes.get_ylim()}
    words = {"xlabel": axes.get_xlabel(), "ylabel": axes.get_ylabel().replace("\n", " ")}
    if isinstance(axes.xaxis.get_major_formatter(), ConciseDateFormatter):
        words["dates"] = "days since 1970-01-01"
    shown = {key: " ".join(f"{value:.9g}" for value in each) for key, each in values.items()} | words
    return " ".join(f'data-{key}="{escape(text)}"' for key, text in shown.items())


def _as_dots(svg: str) -> str:
    """Draw many small round marks as one path of dots: a third of the size, and round under any stretching."""
    return _MARKS.sub(_dots, svg)


def _dots(group: re.Match[str]) -> str:
    places = re.findall(r'x="([^"]*)" y="([^"]*)"', group["marks"])
    if len(places) < _MANY:
        return group[0]
    style = re.search(r'style="([^"]*)"', group["marks"])
    colour = re.search(r"stroke: ([^;\"]*)", style[1] if style else "")
    opacity = re.search(r"opacity: ([^;\"]*)", style[1] if style else "")
    path = "".join(f"M{float(x):.2f} {float(y):.2f}h0" for x, y in places)
    look = f"fill: none; stroke-width: {_DOT}; stroke-linecap: round; stroke: {colour[1] if colour else INK}"
    look += f"; stroke-opacity: {opacity[1]}" if opacity else ""
    return f'<path d="{path}" clip-path="{group["clip"]}" style="{look}"/>'


def envelope(time: Float64, values: Float64, columns: int = COLUMNS) -> tuple[Float64, Float64]:
    """Return the least and the greatest sample of each of `columns` segments, in their order: a peak stays a peak."""
    count = len(values)
    if count <= 2 * columns:
        return time, values
    width = -(-count // columns)
    padded = np.full(width * columns, np.nan)
    padded[:count] = values
    table = padded.reshape(columns, width)
    least = np.where(np.isnan(table), np.inf, table).argmin(axis=1)
    most = np.where(np.isnan(table), -np.inf, table).argmax(axis=1)
    picked: Int64 = np.sort(np.stack([least, most], axis=1), axis=1) + width * np.arange(columns)[:, None]
    index = np.unique(np.minimum(picked.ravel(), count - 1))
    return time[index], values[index]


def broken_at_gaps(time: Float64, values: Float64) -> tuple[Float64, Float64]:
    """Return the samples with a NaN wherever time jumps, so that no line is drawn over a gap."""
    if len(time) < 3:
        return time, values
    steps = np.diff(time)
    after = np.flatnonzero(steps > 10.0 * np.median(steps)) + 1
    return np.insert(time, after, time[after - 1]), np.insert(values, after, np.nan)


def thinned(*columns: Float64, most: int = 900) -> list[Float64]:
    """Return every n-th value of columns of one length, `most` at the utmost."""
    stride = max(1, -(-len(columns[0]) // most))
    return [column[::stride] for column in columns]


def say_empty(axes: Axes, text: str) -> None:
    """Write into an empty plot why it is empty."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=MUTED)
    axes.set_yticks([])
    if len(axes.get_shared_x_axes().get_siblings(axes)) == 1:
        axes.set_xticks([])


def legend_below(figure: Figure, columns: int) -> None:
    """Put one legend for all plots of a figure under them, where it hides no data."""
    if any(axes.get_legend_handles_labels()[1] for axes in figure.axes):
        figure.legend(loc="outside lower center", ncols=columns)
