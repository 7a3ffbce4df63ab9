"""Plots with matplotlib.

The module makes a chart a figure, sets the style of every figure, and writes PNG files and the SVG of a history's page.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from markupsafe import escape
from matplotlib.axes import Axes
from matplotlib.backend_bases import get_registered_canvas_class
from matplotlib.dates import ConciseDateFormatter
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from etb_hil.base.files import replacing
from etb_hil.report.chart import GRID, INK, MUTED, PAPER, VARIABLES, Band, Bars, Box, Chart, Line, Mark, Rule, Text

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


@mpl.rc_context(STYLE)
def new_figure(
    width_in: float, height_in: float, rows: int = 1, ratios: list[float] | None = None
) -> tuple[Figure, list[Axes]]:
    """Return a figure with `rows` plots that share their x axis.

    No global state is touched.
    """
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    grid = figure.subplots(rows, 1, sharex=True, squeeze=False, height_ratios=ratios)
    return figure, list(grid[:, 0])


@mpl.rc_context(STYLE)
def save_png(figure: Figure, path: Path) -> None:
    """Write a figure as PNG, whole or not at all.

    InputError where it cannot be written.
    """
    with replacing(path) as part, _laid_out(figure, "png", PNG_DPI):
        figure.savefig(part, format="png", dpi=PNG_DPI)


@contextmanager
def _laid_out(figure: Figure, form: str, dpi: float) -> Iterator[None]:
    """Place a figure's plots as they will be in a file.

    `savefig` need not draw everything twice for that, then.
    """
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
    """Return a figure as an `<svg>` element for a page.

    `name` keeps its ids apart from those of other figures.

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
    for colour, variable in VARIABLES.items():
        svg = svg.replace(colour, f"var({variable}, {colour})")
    return svg


def _scales(axes: Axes) -> str:
    """Return a plot's frame in the drawing, and the values at its edges.

    The frame is from the top left in points.
    """
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
    """Draw many small round marks as one path of dots.

    The result is a third of the size, and round under any stretching.
    """
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


@mpl.rc_context(STYLE)
def figure_of(chart: Chart) -> Figure:
    """Return a chart as a matplotlib figure."""
    ratios = [panel.ratio for panel in chart.panels]
    figure = Figure(figsize=(chart.width, chart.height), layout="constrained")
    rows = figure.subplots(len(ratios), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
    for axes, panel in zip(rows, chart.panels, strict=True):
        axes.set(title=panel.title, ylim=panel.y_range())
        beside = {"rotation": 0, "ha": "right", "va": "center"} if panel.upright_label else {}
        axes.set_ylabel(panel.y_label, **beside)
        for mark in panel.marks:
            _draw(axes, mark)
        if panel.y_ticks is not None:
            axes.set_yticks(panel.y_ticks)
        axes.grid(visible=panel.grid)
        if panel.empty:
            say_empty(axes, panel.empty)
        if panel.bare:
            axes.set_yticks([])
            axes.grid(visible=False)
            axes.spines[:].set_visible(False)
            axes.tick_params(bottom=False)
    if chart.is_log:
        rows[-1].set_xscale("log")
        rows[-1].xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        rows[-1].xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        rows[-1].xaxis.set_minor_formatter(NullFormatter())
    rows[-1].set(xlim=chart.x_range(), xlabel=chart.x_label)
    figure.align_ylabels(rows)
    legend_below(figure, chart.columns)
    return figure


def _draw(axes: Axes, mark: Mark) -> None:
    match mark:
        case Line(x, y, colour, style, width, marker, size, alpha, label):
            line: dict[str, Any] = {"linestyle": style, "linewidth": width, "marker": marker, "markersize": size}
            axes.plot(x, y, color=colour, alpha=alpha, label=label, **line)
        case Band(x, low, high, colour, alpha, label):
            axes.fill_between(x, low, high, color=colour, alpha=alpha, linewidth=0, label=label)
        case Box((left, right), None, colour, alpha, label):
            axes.axvspan(left, right, color=colour, alpha=alpha, linewidth=0, label=label)
        case Box((left, right), (low, high), colour, alpha, label):
            box = Rectangle((left, low), right - left, high - low, facecolor=colour, alpha=alpha, linewidth=0)
            box.set_label(label or "")
            axes.add_patch(box)
        case Rule(at, colour, is_level, style, width, label):
            rule = axes.axhline if is_level else axes.axvline
            rule(at, color=colour, linestyle=style, linewidth=width, label=label)
        case Bars(x, low, high, colour):
            middle = 0.5 * (low + high)
            axes.errorbar(x, middle, yerr=[middle - low, high - middle], fmt="none", ecolor=colour, capsize=4)
        case Text(x, y, text, size):
            axes.text(x, y, text, ha="center", va="center", fontsize=size, color=INK, clip_on=True)


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
