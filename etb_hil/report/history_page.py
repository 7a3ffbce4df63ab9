"""The page of a history: what many runs say of a part.

The page has charts, distributions and gauge studies.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from etb_hil import __version__
from etb_hil.base.files import write_text
from etb_hil.base.outcome import BenchOutcome
from etb_hil.histories.gauge import GaugeStudy
from etb_hil.histories.history import FRICTION, History, NumberHistory
from etb_hil.report import history_figures
from etb_hil.report.drawing import inline_svg
from etb_hil.report.history_plot import in_units_shown
from etb_hil.report.history_text import GAUGE_LIMITS, UNRESOLVED, lacking, spread_text, statements
from etb_hil.report.page_template import ours, render
from etb_hil.report.show import printable, share
from etb_hil.report.svg import PHONE_WIDTH, for_both_widths
from etb_hil.results.shown import heading, quantity
from etb_hil.store.run import Run

PAGE_NAME = "history.html"
PAGE_WIDTH = 8.0  # inches
_LONGEST = 600  # characters of a text
_CAPABLE = 1.33  # asked of a process that runs (AIAG, PPAP manual, 4th edition 2006, 2.2.11.3, asks 1.33 to 1.67)
_TONES = {"good": "good", "usable": "unsure", "unknown": "unsure", "unsuitable": "bad"}


def write_history_page(found: Sequence[History], path: Path, rows: int, notes: Sequence[str] = ()) -> Path:
    """Write the page of histories, each with its latest `rows` runs.

    Return its path. InputError where it cannot be written.
    """
    drawn = _Drawn()
    page = render(
        "history.html.jinja",
        finalize=_finalize,
        parts=[_part(history, rows, drawn) for history in found],
        notes=notes,
        written=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
        version=__version__,
    )
    return write_text(path, page)


class _Drawn:
    """Draws figures for one page, whose ids must differ."""

    def __init__(self) -> None:
        self._count = 0

    def __call__(self, figure: Figure) -> Markup:
        return ours(self._svg(figure))

    def both(self, draw: Callable[[float], Figure]) -> Markup:
        """Draw a figure at the page's width and at a phone's, of which the page shows one."""
        return ours(for_both_widths(self._svg(draw(PAGE_WIDTH)), self._svg(draw(PHONE_WIDTH))))

    def _svg(self, figure: Figure) -> str:
        self._count += 1
        return inline_svg(figure, f"figure-{self._count}")


def _part(history: History, rows: int, drawn: _Drawn) -> dict[str, Any]:
    numbers = [number for number in history.numbers if number.at]
    alarms = [
        f"{heading(number.id, number.name)}: {text}"
        for number in numbers
        for _, text in statements(number)
        if "ALARM" in text
    ]
    runs = history.runs
    told = [_number(history, number, drawn) for number in numbers]
    tones = {tone for number in told for tone, _ in number["badges"]}
    return {
        "name": f"{history.part_number} revision {history.revision}",
        "scenario": history.scenario,
        "tone": next((tone for tone in ("bad", "unsure") if tone in tones), "good"),
        "alarms": alarms,
        "runs": len(runs),
        "units": history.units,
        "benches": len({run.bench for run in runs}),
        "counting": sum(run.counts for run in runs),
        "numbers": told,
        "measured": [number.name for number in history.numbers if number.id in FRICTION],
        "rows": [_row(run) for run in reversed(runs[-rows:])],
        "earlier": max(len(runs) - rows, 0),
    }


def _number(history: History, number: NumberHistory, drawn: _Drawn) -> dict[str, Any]:
    has_chart, drawable = number.chart is not None, in_units_shown(number)
    return {
        "name": heading(number.id, number.name),
        "badges": _badges(number),
        "over_time": drawn.both(lambda width: history_figures.over_time(history, drawable, width)),
        "chart": drawn(history_figures.chart(drawable)) if has_chart else "",
        "spread": drawn(history_figures.spread(drawable)) if has_chart else "",
        "statements": [*statements(number), *lacking(number)],
        "gauge": None if number.gauge is None else _gauge(number.gauge, number.unit),
    }


def _badges(number: NumberHistory) -> list[tuple[str, str]]:
    badges = []
    if number.chart is not None:
        steady = number.chart.is_steady
        badges.append(("good", "in control") if steady else ("unsure", "not in control"))
        has_limit = number.limit_low is not None or number.limit_high is not None
        if number.capability is not None:
            index = number.capability.ppk
            tone = "good" if index.low >= _CAPABLE else "bad" if index.high < _CAPABLE else "unsure"
            badges.append((tone, f"Ppk {index.value:.2f} ({index.low:.2f} to {index.high:.2f})"))
        elif has_limit:
            badges.append(("unsure", "no capability: distribution unknown"))
        elif number.differing_limits:
            badges.append(("unsure", "no capability: limits differ"))
    if number.gauge is not None:
        badges.append((_TONES[number.gauge.verdict], f"gauge {number.gauge.verdict}"))
    if number.drifts or (number.rises is not None and number.rises.found):
        badges.append(("bad", "alarm"))
    return badges


def _gauge(study: GaugeStudy, unit: str) -> dict[str, Any]:
    sources = (
        ("repeatability (EV)", study.repeatability),
        ("reproducibility (AV)", study.reproducibility),
        ("gauge (GRR)", study.gauge),
        ("units (PV)", study.part),
        ("total (TV)", study.total),
    )
    rows = [
        (name, "unknown: one bench", "") if sigma is None
        else (name, spread_text(sigma, unit), share(study.share(sigma)))
        for name, sigma in sources
    ]  # fmt: skip
    categories = "" if study.categories is None else f"Distinct categories: {study.categories}. "
    note = (
        f"{study.units} units x {study.benches} benches x {study.trials} runs. {categories}"
        f"{'' if study.is_resolved else f'{UNRESOLVED} '}"
        f"Limits of the study's variation (AIAG, MSA, 4th edition 2010): {GAUGE_LIMITS}."
    )
    return {"verdict": study.verdict, "rows": rows, "note": note}


def _row(run: Run) -> dict[str, Any]:
    verdict = run.verdict if run.bench_outcome == BenchOutcome.OK else f"bench {run.bench_outcome}"
    return {
        "started": run.started[:16].replace("T", " "),
        "serial": run.serial or "-",
        "bench": run.bench,
        "measured": [quantity(run.numbers[name].value, "N·m") if name in run.numbers else "" for name in FRICTION],
        "temperature": "" if run.temperature is None else quantity(run.temperature, "degC"),
        "verdict": str(verdict) if run.counts else f"({verdict})",
        "tone": str(run.verdict) if run.counts else "",
    }


def _finalize(value: object) -> object:
    """Take control characters and endless names out of what goes into the page."""
    return printable(value, _LONGEST) if isinstance(value, str) and not isinstance(value, Markup) else value
