"""A chart as an `<svg>` element in the page's light and dark colours.

Texts stay texts.

Each panel's group carries its frame and its ranges (`data-box`, `data-x`, `data-y`), by which `zoom.js` works.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from markupsafe import escape

from etb_hil.recording.samples import Float64
from etb_hil.report import ticks
from etb_hil.report.chart import (
    GRID,
    INK,
    MUTED,
    PAPER,
    VARIABLES,
    Band,
    Bars,
    Box,
    Chart,
    Line,
    Mark,
    Panel,
    Rule,
    Text,
    share_of_range,
)

_DASHES = {"--": (3.7, 1.6), ":": (1.0, 1.65), "-.": (6.4, 1.6, 1.0, 1.6)}  # of a line one point wide
_OUTLINES = {  # markers of size two about the origin
    "o": "M-1 0a1 1 0 1 0 2 0a1 1 0 1 0 -2 0z",
    "s": "M-1 -1h2v2h-2z",
    "^": "M0 -1L1 1H-1z",
    "v": "M0 1L1 -1H-1z",
    "x": "M-1 -1L1 1M-1 1L1 -1",
}
_DOT = 2.2 / 2.5  # diameter of a dot, times its size

# In points.
_SIZE, _TITLE, _SMALL = 10.0, 11.0, 9.0
_EDGE, _BETWEEN, _ABOVE_TITLE, _BELOW_TITLE = 6.0, 9.0, 4.0, 6.0
_TICK, _PAD, _LEADING = 3.5, 3.5, 1.25
_HANDLE, _HANDLE_GAP, _COLUMN_GAP, _ROW = 20.0, 7.0, 18.0, 14.0
_CAP = 4.0

PHONE_WIDTH = 5.2  # inches of a chart that fills a screen 390 px wide: a point is about a pixel there


@dataclass(frozen=True, slots=True)
class _Frame:
    """Where a panel's marks stand, and the values at its edges.

    Places are from the top left in points.
    """

    left: float
    top: float
    width: float
    height: float
    x: tuple[float, float]
    y: tuple[float, float]
    is_log: bool

    def across(self, value: Float64 | float) -> Float64:
        low, high = self.x
        values = np.asarray(value, np.float64)
        if self.is_log:
            with np.errstate(all="ignore"):
                values, low, high = np.log10(values), math.log10(low), math.log10(high)
        return self.left + self.width * share_of_range(values, low, high)

    def down(self, value: Float64 | float) -> Float64:
        low, high = self.y
        return self.top + self.height * share_of_range(np.asarray(value, np.float64), high, low)

    @property
    def box(self) -> str:
        return f'x="{self.left:.2f}" y="{self.top:.2f}" width="{self.width:.2f}" height="{self.height:.2f}"'


def svg_of(chart: Chart, name: str) -> str:
    """Return a chart as an `<svg>` element for a page.

    `name` keeps its ids apart from those of other charts.
    """
    width, height = 72.0 * chart.width, 72.0 * chart.height
    legend = _Legend(chart, width)
    scales = [_y_ticks(panel, height / len(chart.panels)) for panel in chart.panels]
    left = _EDGE + max(map(_left_margin, chart.panels, scales))
    below = _TICK + _PAD + _SIZE + (_SIZE * _LEADING + 3.0 * _PAD if chart.x_label else 0.0) + legend.height
    heads = [_head(panel, is_first=k == 0) for k, panel in enumerate(chart.panels)]
    share = (height - _EDGE - below - sum(heads)) / sum(panel.ratio for panel in chart.panels)
    across = width - left - 2.0 * _EDGE
    font = f"font: {_SIZE:g}px 'DejaVu Sans', Verdana, sans-serif"
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" role="img" style="{font}">',
        f'<rect width="{width:g}" height="{height:g}" style="fill: {_colour(PAPER)}"/>',
    ]
    top = _EDGE
    x_range = chart.x_range()
    for number, (panel, head) in enumerate(zip(chart.panels, heads, strict=True)):
        top += head
        frame = _Frame(left, top, across, share * panel.ratio, x_range, panel.y_range(), chart.is_log)
        parts += _panel(chart, panel, frame, f"{name}-{number}", is_last=number == len(chart.panels) - 1)
        top += frame.height
    if chart.x_label:
        parts.append(_words(left + 0.5 * across, top + _TICK + 2 * _PAD + 2.0 * _SIZE, chart.x_label, "middle"))
    parts += legend.drawn(0.5 * width, height - legend.height)
    return "\n".join([*parts, "</svg>"])


def drawings_of(chart: Chart, name: str) -> str:
    """Return a chart for wide screens, and one for phones if it is too wide.

    The style of the page shows one of both, so that texts have a legible size on each.
    """
    if chart.width <= PHONE_WIDTH:
        return svg_of(chart, name)
    return for_both_widths(svg_of(chart, name), svg_of(replace(chart, width=PHONE_WIDTH), f"{name}-narrow"))


def for_both_widths(wide: str, narrow: str) -> str:
    """Return two drawings of one content, of which the style of the page shows one."""
    return f'<div class="wide">{wide}</div><div class="narrow">{narrow}</div>'


def _head(panel: Panel, *, is_first: bool) -> float:
    """Return the height above a panel's frame."""
    title = _TITLE + _BELOW_TITLE + (0.0 if is_first else _ABOVE_TITLE) if panel.title else 0.0
    return title + (0.0 if is_first else _BETWEEN)


def _y_ticks(panel: Panel, height: float) -> list[tuple[float, str]]:
    low, high = panel.y_range()
    if panel.bare or panel.empty:
        return []
    if panel.y_ticks is not None:
        return [(value, f"{value:.6g}".replace("-", ticks.MINUS)) for value in panel.y_ticks]
    return ticks.linear(low, high, math.floor(height / (2.0 * _SIZE)))


def _left_margin(panel: Panel, scale: list[tuple[float, str]]) -> float:
    """Return the width left of a panel's frame that its scale and its label need."""
    numbers = max((_width(text, _SIZE) for _, text in scale), default=0.0)
    lines = panel.y_label.split("\n") if panel.y_label else []
    label = max(_width(line, _SIZE) for line in lines) if lines and panel.upright_label else _LEADING * _SIZE
    return numbers + _TICK + _PAD + (label + _PAD if lines else 0.0)


def _panel(chart: Chart, panel: Panel, frame: _Frame, name: str, *, is_last: bool) -> Iterator[str]:
    bottom, right = frame.top + frame.height, frame.left + frame.width
    words = {"xlabel": chart.x_label if is_last else "", "ylabel": panel.y_label.replace("\n", " ")}
    data = "".join(f' data-{key}="{escape(text)}"' for key, text in words.items())
    if not chart.is_log:
        box = (frame.left, frame.top, frame.width, frame.height)
        shown = {"box": box, "x": frame.x, "y": frame.y}
        data = "".join(f' data-{k}="{" ".join(f"{v:.9g}" for v in each)}"' for k, each in shown.items()) + data
    yield f'<g id="{name}"{data}>'
    yield f'<clipPath id="{name}-clip"><rect {frame.box}/></clipPath>'
    yield from _x_scale(chart, panel, frame, is_last=is_last)
    scale = _y_ticks(panel, frame.height)
    yield '<g class="axis">'
    for value, text in scale:
        at = float(frame.down(value))
        grid = _grid(frame.left, right, at, at) if panel.grid else ""
        mark = _stroke(f"M{frame.left:.2f} {at:.2f}h{-_TICK:g}", MUTED, 0.8)
        number = _words(frame.left - _TICK - _PAD, at + 0.35 * _SIZE, text, "end")
        yield f'<g class="tick">{grid}{mark}{number}</g>'
    yield "</g>"
    drawn = [_drawn(mark, frame) for mark in _by_depth(panel.marks)]
    lines, marks = ("".join(each[k] for each in drawn) for k in (0, 1))
    yield from (f'<g><g clip-path="url(#{name}-clip)">{each}</g></g>' for each in (lines, marks) if each)
    if not panel.bare:
        yield _stroke(f"M{frame.left:.2f} {frame.top:.2f}V{bottom:.2f}H{right:.2f}", MUTED, 0.8)
    if panel.empty:
        middle = frame.left + 0.5 * frame.width, frame.top + 0.5 * frame.height + 0.35 * _SIZE
        yield _words(*middle, panel.empty, "middle", MUTED)
    if panel.title:
        yield _words(frame.left, frame.top - _BELOW_TITLE, panel.title, size=_TITLE, weight=" font-weight: bold;")
    yield from _y_label(panel, frame, max((_width(text, _SIZE) for _, text in scale), default=0.0))
    yield "</g>"


def _x_scale(chart: Chart, panel: Panel, frame: _Frame, *, is_last: bool) -> Iterator[str]:
    yield '<g class="axis">'
    bottom = frame.top + frame.height
    if not panel.bare and not (panel.empty and len(chart.panels) == 1):
        most = math.floor(frame.width / (3.0 * _SIZE))
        scale = ticks.logarithmic(*frame.x) if chart.is_log else ticks.linear(*frame.x, most)
        for value, text in scale:
            at = float(frame.across(value))
            grid = _grid(at, at, frame.top, bottom) if panel.grid else ""
            number = _words(at, bottom + _TICK + _PAD + 0.8 * _SIZE, text, "middle") if is_last else ""
            yield f'<g class="tick">{grid}{_stroke(f"M{at:.2f} {bottom:.2f}v{_TICK:g}", MUTED, 0.8)}{number}</g>'
    yield "</g>"


def _y_label(panel: Panel, frame: _Frame, numbers: float) -> Iterator[str]:
    if not panel.y_label:
        return
    lines, middle = panel.y_label.split("\n"), frame.top + 0.5 * frame.height
    if panel.upright_label:
        right = frame.left - _TICK - 2.0 * _PAD - numbers
        first = middle - 0.5 * _LEADING * _SIZE * (len(lines) - 1) + 0.35 * _SIZE
        for k, line in enumerate(lines):
            yield _words(right, first + k * _LEADING * _SIZE, line, "end")
        return
    x = frame.left - _TICK - 2.0 * _PAD - numbers - 0.25 * _SIZE
    yield _words(x, middle, " ".join(lines), "middle", turn=f' transform="rotate(-90 {x:.2f} {middle:.2f})"')


def _by_depth(marks: list[Mark]) -> list[Mark]:
    """Return areas before lines, and texts above all."""
    return sorted(marks, key=lambda mark: 0 if isinstance(mark, Band | Box) else 2 if isinstance(mark, Text) else 1)


def _drawn(mark: Mark, frame: _Frame) -> tuple[str, str]:
    """Return what a zoom scales of a mark, and what it only moves."""
    right, bottom = frame.left + frame.width, frame.top + frame.height
    if isinstance(mark, Line):
        return _line(mark, frame)
    if isinstance(mark, Band):
        x = frame.across(mark.x)
        outline = np.concatenate([x, x[::-1]]), np.concatenate([frame.down(mark.low), frame.down(mark.high)[::-1]])
        return f'<path d="{_path(*outline)}z" style="{_fill(mark)}"/>', ""
    if isinstance(mark, Box):
        x0, x1 = frame.across(np.array(mark.x))
        y1, y0 = frame.down(np.array(mark.y)) if mark.y else (frame.top, bottom)
        box = f"M{x0:.2f} {y1:.2f}H{x1:.2f}V{y0:.2f}H{x0:.2f}z"
        return f'<path d="{box}" style="{_fill(mark)}"/>', ""
    if isinstance(mark, Rule):
        if mark.is_level:
            path = f"M{frame.left:.2f} {float(frame.down(mark.at)):.2f}H{right:.2f}"
        else:
            path = f"M{float(frame.across(mark.at)):.2f} {frame.top:.2f}V{bottom:.2f}"
        return _stroke(path, mark.colour, mark.width, mark.style), ""
    if isinstance(mark, Bars):
        bars = zip(frame.across(mark.x), frame.down(mark.low), frame.down(mark.high), strict=True)
        caps = f"h{-2 * _CAP:g}m{_CAP:g} 0"
        path = "".join(f"M{x + _CAP:.2f} {low:.2f}{caps}V{high:.2f}m{_CAP:g} 0h{-2 * _CAP:g}" for x, low, high in bars)
        return _stroke(path, mark.colour, 1.3), ""
    place = float(frame.across(mark.x)), float(frame.down(mark.y)) + 0.35 * mark.size
    return "", _words(*place, mark.text, "middle", size=mark.size)


def _line(mark: Line, frame: _Frame) -> tuple[str, str]:
    x, y = frame.across(mark.x), frame.down(mark.y)
    scaled = _stroke(_path(x, y), mark.colour, mark.width, mark.style, mark.alpha) if mark.style else ""
    good = np.isfinite(x) & np.isfinite(y)
    if mark.marker == ".":  # one path of dots: a third of the size, and round under any zoom
        dots = "".join(f"M{a:.2f} {b:.2f}h0" for a, b in zip(x[good], y[good], strict=True))
        return scaled + _stroke(dots, mark.colour, _DOT * mark.size, "-", mark.alpha, " stroke-linecap: round;"), ""
    if not mark.marker:
        return scaled, ""
    places = zip(x[good], y[good], strict=True)
    return scaled, "".join(_marker(mark, float(a), float(b)) for a, b in places)


def _marker(mark: Line, x: float, y: float) -> str:
    half = 0.5 * mark.size + 0.5
    is_open = mark.marker == "x"
    look = f"stroke: {_colour(mark.colour)}; stroke-width: {1.2 / half:.3g};" if is_open else ""
    look += f" fill: {'none' if is_open else _colour(mark.colour)}; opacity: {mark.alpha:g}"
    shape = f'd="{_OUTLINES[mark.marker]}"'
    return f'<g class="mark"><path {shape} transform="translate({x:.2f} {y:.2f}) scale({half:g})" style="{look}"/></g>'


def _path(x: Float64, y: Float64) -> str:
    """Return the path through points; one that is NaN interrupts it."""
    parts, pen = [], "M"
    for a, b in zip(x.tolist(), y.tolist(), strict=True):
        if math.isfinite(a) and math.isfinite(b):
            parts.append(f"{pen}{a:.2f} {b:.2f}")
            pen = "L"
        else:
            pen = "M"
    return "".join(parts)


def _stroke(path: str, colour: str, width: float, style: str = "-", alpha: float = 1.0, more: str = "") -> str:
    dashes = " ".join(f"{width * each:.3g}" for each in _DASHES.get(style, ()))
    look = f"fill: none; stroke: {_colour(colour)}; stroke-width: {width:.3g}; stroke-linejoin: round;{more}"
    look += f" stroke-dasharray: {dashes};" if dashes else ""
    look += f" stroke-opacity: {alpha:g};" if alpha < 1.0 else ""
    return f'<path d="{path}" style="{look}"/>' if path else ""


def _grid(x0: float, x1: float, y0: float, y1: float) -> str:
    return _stroke(f"M{x0:.2f} {y0:.2f}L{x1:.2f} {y1:.2f}", GRID, 0.6)


def _fill(mark: Band | Box) -> str:
    return f"fill: {_colour(mark.colour)}; fill-opacity: {mark.alpha:.3g}"


def _words(
    x: float,
    y: float,
    text: str,
    anchor: str = "start",
    colour: str = INK,
    *,
    size: float = _SIZE,
    weight: str = "",
    turn: str = "",
) -> str:
    look = f"fill: {_colour(colour)}; text-anchor: {anchor};{weight}" + (f" font-size: {size:g}px" * (size != _SIZE))
    return f'<text x="{x:.2f}" y="{y:.2f}" style="{look}"{turn}>{escape(text)}</text>' if text else ""


def _colour(colour: str) -> str:
    return f"var({VARIABLES[colour]}, {colour})"


def _width(text: str, size: float) -> float:
    """Return about how wide a text is in DejaVu Sans, in points."""
    narrow, wide = (
        sum(letter in " .,:;'|ijlft()/r·°I" for letter in text),
        sum(letter in "mwMW%\u2212+" for letter in text),
    )
    return size * (0.62 * len(text) - 0.28 * narrow + 0.25 * wide)


class _Legend:
    """One legend for all panels, below them, where it hides no data.

    The legend is filled column by column.
    """

    def __init__(self, chart: Chart, width: float) -> None:
        labels = [(mark, str(getattr(mark, "label", ""))) for mark in chart.labelled]
        for count in range(max(1, chart.columns), 0, -1):
            self._rows = -(-len(labels) // count)
            self._columns = [labels[k : k + self._rows] for k in range(0, len(labels), max(1, self._rows))]
            needs = [max(_width(label, _SMALL) for _, label in column) for column in self._columns]
            self._widths = [_HANDLE + _HANDLE_GAP + each + _COLUMN_GAP for each in needs]
            if sum(self._widths) - _COLUMN_GAP <= width - 2.0 * _EDGE:
                break
        self.height = _ROW * self._rows + _EDGE

    def drawn(self, middle: float, top: float) -> Iterator[str]:
        """Yield the legend, centred on a place."""
        x = max(_EDGE, middle - 0.5 * (sum(self._widths) - _COLUMN_GAP))
        for column, width in zip(self._columns, self._widths, strict=True):
            for row, (mark, label) in enumerate(column):
                y = top + _ROW * (row + 0.5)
                yield _handle(mark, x, y)
                yield _words(x + _HANDLE + _HANDLE_GAP, y + 0.35 * _SMALL, label, size=_SMALL)
            x += width


def _handle(mark: Mark, x: float, y: float) -> str:
    """Return the sample of a mark that stands before its label."""
    if isinstance(mark, Band | Box):
        return f'<path d="M{x:.2f} {y - 3.5:.2f}h{_HANDLE:g}v7h{-_HANDLE:g}z" style="{_fill(mark)}"/>'
    frame = _Frame(x, y - 5.0, _HANDLE, 10.0, (0.0, 1.0), (0.0, 1.0), is_log=False)
    if isinstance(mark, Rule):
        return _stroke(f"M{x:.2f} {y:.2f}h{_HANDLE:g}", mark.colour, mark.width, mark.style)
    if not isinstance(mark, Line):
        return ""
    ends, middle = np.array([0.0, 1.0]), np.array([0.5])
    line = replace(mark, x=ends, y=np.array([0.5, 0.5]), marker="")
    return "".join((*_line(line, frame), *_line(replace(mark, x=middle, y=middle, style=""), frame)))
