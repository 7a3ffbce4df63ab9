"""Contents of a plot: panels that share their x axis, and the marks in them.

A chart draws nothing. `svg` makes it an `<svg>` element, and `drawing` a matplotlib figure.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from etb_hil.recording.samples import Float64

# Okabe and Ito's colours, distinguished with any colour vision; what a colour says, a line style or a marker says
# again.
INK, MUTED, GRID, PAPER = "#1b1f24", "#5c6670", "#d5dae0", "#fdfefe"
MEASURED, OPENING, CLOSING, LIMIT = "#0072b2", "#00765a", "#a8479a", "#d55e00"

# The variables that a page sets to make an SVG follow its light or dark colours.
VARIABLES = {
    INK: "--plot-ink",
    MUTED: "--plot-muted",
    GRID: "--plot-grid",
    PAPER: "--plot-paper",
    MEASURED: "--plot-measured",
    OPENING: "--plot-opening",
    CLOSING: "--plot-closing",
    LIMIT: "--plot-limit",
}

MARGIN = 0.05  # of a range, free at each end of an axis
_NOTHING = (0.0, 1.0)
_LARGEST = sys.float_info.max


@dataclass(frozen=True, slots=True)
class Line:
    """Points (n, n) in their order.

    They are joined where `style` is `-`, `--`, `-.` or `:`, marked where `marker` is given.

    A NaN breaks the line. Markers are `.`, `o`, `s`, `^`, `v` and `x`, `size` points wide.
    """

    x: Float64
    y: Float64
    colour: str
    style: str = "-"
    width: float = 1.3
    marker: str = ""
    size: float = 5.0
    alpha: float = 1.0
    label: str | None = None


@dataclass(frozen=True, slots=True)
class Band:
    """The area between two curves (n) over x (n)."""

    x: Float64
    low: Float64
    high: Float64
    colour: str
    alpha: float
    label: str | None = None


@dataclass(frozen=True, slots=True)
class Box:
    """A filled rectangle; without `y` it reaches over the whole height of its panel."""

    x: tuple[float, float]
    y: tuple[float, float] | None
    colour: str
    alpha: float
    label: str | None = None


@dataclass(frozen=True, slots=True)
class Rule:
    """A straight line through the whole panel.

    The line is at a y value where `is_level`, else at an x value.
    """

    at: float
    colour: str
    is_level: bool = True
    style: str = "-"
    width: float = 1.3
    label: str | None = None


@dataclass(frozen=True, slots=True)
class Bars:
    """Vertical intervals (n) with caps at x (n)."""

    x: Float64
    low: Float64
    high: Float64
    colour: str


@dataclass(frozen=True, slots=True)
class Text:
    """A text that is centred on a place, and cut at the panel's frame."""

    x: float
    y: float
    text: str
    size: float = 8.0


Mark: TypeAlias = Line | Band | Box | Rule | Bars | Text


@dataclass(slots=True)
class Panel:
    """A plot with its own y axis; `ratio` is its share of the height.

    `empty` is why there is nothing to see. A `bare` panel has no scales and no frame. `y_ticks` replace those that the
    range suggests. An `upright_label` is written beside the axis, not along it.
    """

    title: str = ""
    y_label: str = ""
    ratio: float = 1.0
    marks: list[Mark] = field(default_factory=list)
    empty: str = ""
    y_limits: tuple[float, float] | None = None
    y_ticks: Sequence[float] | None = None
    grid: bool = True
    bare: bool = False
    upright_label: bool = False

    def line(
        self,
        x: Float64 | Sequence[float],
        y: Float64 | Sequence[float],
        colour: str,
        style: str = "-",
        *,
        width: float = 1.3,
        marker: str = "",
        size: float = 5.0,
        alpha: float = 1.0,
        label: str | None = None,
    ) -> None:
        """Draw points that are joined, marked or both."""
        points = np.asarray(x, np.float64), np.asarray(y, np.float64)
        self.marks.append(Line(*points, colour, style, width, marker, size, alpha, label))

    def level(self, at: float, colour: str, style: str = "-", width: float = 1.3, label: str | None = None) -> None:
        """Draw a horizontal line through the whole panel."""
        self.marks.append(Rule(at, colour, style=style, width=width, label=label))

    def y_range(self) -> tuple[float, float]:
        """Return the least and the greatest value of the y axis."""
        return self.y_limits or _with_margin(value for mark in self.marks for value in _heights(mark))


@dataclass(slots=True)
class Chart:
    """Panels above each other.

    `width` and `height` are in inches, `columns` are those of the legend below.
    """

    width: float
    height: float
    panels: list[Panel]
    x_label: str = ""
    columns: int = 1
    x_limits: tuple[float, float] | None = None
    is_log: bool = False

    def x_range(self) -> tuple[float, float]:
        """Return the least and the greatest value of the x axis that all panels share."""
        if self.x_limits is not None:
            return self.x_limits
        values = (value for panel in self.panels for mark in panel.marks for value in _widths(mark))
        if not self.is_log:
            return _with_margin(values)
        low, high = _with_margin(math.log10(value) for value in values if value > 0.0)
        return 10.0**low, 10.0**high

    @property
    def labelled(self) -> list[Mark]:
        """The marks that the legend names."""
        return [mark for panel in self.panels for mark in panel.marks if getattr(mark, "label", None)]


def _extremes(values: Float64) -> list[float]:
    good = values[np.isfinite(values)]
    return [float(good.min()), float(good.max())] if len(good) else []


def _widths(mark: Mark) -> Iterable[float]:
    if isinstance(mark, Line | Band | Bars):
        return _extremes(mark.x)
    if isinstance(mark, Box):
        return mark.x
    return [mark.at] if isinstance(mark, Rule) and not mark.is_level else []


def _heights(mark: Mark) -> Iterable[float]:
    if isinstance(mark, Line):
        return _extremes(mark.y)
    if isinstance(mark, Band | Bars):
        return [*_extremes(mark.low), *_extremes(mark.high)]
    if isinstance(mark, Box):
        return mark.y or []
    return [mark.at] if isinstance(mark, Rule) and mark.is_level else []


def share_of_range(value: Float64, low: float, high: float) -> Float64:
    """Return where values (n) are between `low` (0) and `high` (1)."""
    half = 1.0 if math.isfinite(high - low) else 0.5  # the difference of two finite numbers may be beyond float64
    return (half * value - half * low) / (half * high - half * low)


def _with_margin(values: Iterable[float]) -> tuple[float, float]:
    found = list(values)
    if not found:
        return _NOTHING
    low, high = min(found), max(found)
    room = min(MARGIN * (high - low) or MARGIN * abs(high) or MARGIN, _LARGEST)
    return max(low - room, -_LARGEST), min(high + room, _LARGEST)
