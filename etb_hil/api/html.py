"""Notebook output: a line, a table, notes and a picture."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from itertools import count
from typing import TYPE_CHECKING

from etb_hil.results import shown
from etb_hil.results.measurement import Measurement

if TYPE_CHECKING:
    from etb_hil.report.chart import Chart

_SHOWN = 40  # rows
_DRAWN = count(1)  # pictures of one notebook must not share the ids inside them


def table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table; of many rows the first forty, and how many are left out."""
    listed = list(rows)
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    body = "".join(f"<tr>{''.join(f'<td>{escape(str(cell))}</td>' for cell in row)}</tr>" for row in listed[:_SHOWN])
    left = f"<p>{len(listed) - _SHOWN} more</p>" if len(listed) > _SHOWN else ""
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{left}"


def page(about: str, content: str, notes: Iterable[str] = (), *charts: Chart | None) -> str:
    """Return a line in bold, the content, notes, and pictures as SVG."""
    from etb_hil.report.svg import svg_of

    said = "".join(f"<p>{escape(note)}</p>" for note in notes)
    drawn = "".join(svg_of(chart, f"etb-{next(_DRAWN)}") for chart in charts if chart is not None)
    return f'<div style="max-width: 60em"><p><b>{escape(about)}</b></p>{content}{said}{drawn}</div>'


def measurements(found: Mapping[str, Measurement]) -> str:
    """Return a table of measurements with their intervals, limits and verdicts."""
    rows = [
        (
            one.id,
            one.name,
            shown.measured(one),
            shown.interval(one),
            shown.limits(one),
            "" if one.verdict is None else str(one.verdict),
            one.note,
        )
        for one in found.values()
    ]
    return table(("id", "measurement", "value", "95 % interval", "allowed", "verdict", "note"), rows)
