"""The report: one HTML page that needs nothing beside it.

Its plots are PNG files on request.
"""

from __future__ import annotations

import hashlib
from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path, PurePath
from typing import Any

from markupsafe import Markup, escape

from etb_hil.base.errors import InputError
from etb_hil.base.files import write_text
from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.diagnosis.exceedance import KINDS
from etb_hil.report import condition_plots, plots, show
from etb_hil.report.grades import bus_facts, timing_facts
from etb_hil.report.page_template import ours, render
from etb_hil.report.series import ReportSeries
from etb_hil.report.show import phase_name
from etb_hil.report.svg import drawings_of
from etb_hil.report.unit_codes import facts, measured_for
from etb_hil.report.verdict import unit_line, verdict_of
from etb_hil.results import shown
from etb_hil.results.measurement import Measurement
from etb_hil.results.run_result import Exceedance, RunResult
from etb_hil.session.photos import photo_name, read_photo

REPORT_NAME = "report.html"

_MOST_NUMBERS = 100  # twice what a run of all phases gives; two printed pages hold the first 16, as report.css says
# What two printed pages hold; the rest is in results.json, and the page says so.
_MOST_PHASES, _MOST_EXCEEDANCES, _MOST_MESSAGES, _MOST_INPUTS = 16, 7, 7, 6
_MOST_PROMPTS, _MOST_RATES = 4, 8
_MOST_CODES = 8
_LONGEST_UNIT, _LONGEST_NAME, _LONGEST_PHRASE, _LONGEST_VERSIONS, _LONGEST_SENTENCE = 20, 40, 120, 160, 480
_LARGEST_INPUT = 200_000  # bytes of a file that the page carries
_SAFE_STATE = {True: "yes, seen in the measured current", False: "NOT VERIFIED", None: "not looked at"}

_PLOTS = {
    "friction_over_speed": plots.friction_over_speed,
    "friction_over_angle": plots.friction_over_angle,
    "time_traces": plots.time_traces,
}
_FURTHER = {  # where a run tells it
    "break_away_over_rate": condition_plots.break_away_over_rate,
    "friction_over_temperature": condition_plots.friction_over_temperature,
}
_AT_RATE = "T_st_at_rate_"


def write_report(
    results: RunResult,
    series: ReportSeries | Mapping[str, Any],
    folder: Path,
    next_step: str = "",
    *,
    pictures: bool = False,
) -> Path:
    """Write `report.html`, and with `pictures` each plot as PNG; return its path.

    The folder exists.

    The page carries the text of the inputs that lie in the folder's `inputs`, as a session has them. `series` may be
    columns by name; `next_step` as of `verdict_of`. Raises InputError where a file
    cannot be written.
    """
    series = series if isinstance(series, ReportSeries) else ReportSeries.from_mapping(series)
    charts = {name: draw(series, results) for name, draw in (*_PLOTS.items(), *_FURTHER.items())}
    drawn = {name: drawings_of(chart, name) for name, chart in charts.items() if chart is not None}
    if pictures:
        from etb_hil.report.drawing import figure_of, save_png  # noqa: PLC0415 (matplotlib takes its time to load)

        for name, chart in charts.items():
            if chart is not None:
                save_png(figure_of(chart), folder / f"{name}.png")
    page = render_page(
        results,
        drawn,
        _input_texts(results, folder / "inputs"),
        next_step,
        tuple(_photos(results, folder)),
        has_friction=bool(len(series.point_velocity) or len(series.curve_velocity)),
    )
    return write_text(folder / REPORT_NAME, page)


def render_page(
    results: RunResult,
    drawn: Mapping[str, str],
    texts: Mapping[str, str],
    next_step: str = "",
    photos: tuple[tuple[str, str], ...] = (),
    *,
    has_friction: bool = True,
) -> str:
    """Return the page.

    `drawn` maps plots to their `<svg>` elements, `texts` inputs to what they hold.

    `photos` are pairs of a prompt's text and a photo as a data URL. `has_friction`: friction torque was estimated.
    """
    verdict = verdict_of(results, next_step)
    says = results.unit_diagnostics
    read = "before" if says is not None and says.codes_after is None else "after"
    told = () if says is None else (says.codes_before if says.codes_after is None else says.codes_after) or ()
    at_rates = [one for one in results.measurements.values() if one.id.startswith(_AT_RATE)]
    numbers = sorted((one for one in results.measurements.values() if one not in at_rates), key=_how_urgent)
    made_by = [*results.versions.items(), *((f"plug-in {one.name}", one.version) for one in results.plugins)]
    versions = ", ".join(f"{name} {version}".strip() for name, version in made_by)
    return render(
        "report.html.jinja",
        _FILTERS,
        _finalize,
        results=results,
        verdict=verdict,
        reason=_sentence(verdict.reason),
        further=[_sentence(text) for text in verdict.further],
        next_step=_sentence(verdict.next_step),
        unit_line=_sentence(unit_line(results)),
        safe_state=_SAFE_STATE[results.bench.safe_state],
        grades=[(name, _sentence(text)) for name, text in (*bus_facts(results), *timing_facts(results))],
        phase_name=phase_name,
        unit_facts=[] if says is None else [(name, _sentence(text)) for name, text in facts(says)],
        codes=[
            (code.code, _sentence(code.text or "not a code of a throttle body"), _sentence(measured_for(code, results)))
            for code in told[:_MOST_CODES]
        ],
        codes_read=read,
        of_codes=len(told),
        numbers=numbers[:_MOST_NUMBERS],
        of_numbers=len(numbers),
        at_rates=at_rates[:_MOST_RATES],
        of_rates=len(at_rates),
        phases=results.phases[:_MOST_PHASES],
        prompts=results.prompts[:_MOST_PROMPTS],
        photos=[(text, ours(photo)) for text, photo in photos],
        exceedances=_highest(results.exceedances),
        no_exceedance=_sentence(_no_exceedance(results, has_friction=has_friction)),
        messages=results.bus.messages[:_MOST_MESSAGES],
        inputs=results.inputs[:_MOST_INPUTS],
        run_id=_sentence(results.run_id[:90]),
        versions=_sentence(versions[:_LONGEST_VERSIONS]),
        texts={name: _text(text) for name, text in texts.items()},
        speed_plot=ours(drawn["friction_over_speed"]),
        angle_plot=ours(drawn["friction_over_angle"]),
        time_plot=ours(drawn["time_traces"]),
        further_plots=[(name.replace("_", " ").capitalize(), ours(drawn[name])) for name in _FURTHER if name in drawn],
    )


def _how_urgent(one: Measurement) -> int:
    """Sort what did not pass before what passed, and that before what has no limit."""
    return 2 if one.verdict is None else int(one.verdict is UnitVerdict.PASS)


def _photos(results: RunResult, folder: Path) -> Iterator[tuple[str, str]]:
    """Yield text and photo of each prompt that asked for one.

    Photos that the session does not hold are left out.
    """
    for prompt in results.prompts[:_MOST_PROMPTS]:
        is_ours = prompt.entry == photo_name(prompt.id) and PurePath(prompt.id).name == prompt.id
        if is_ours and (path := folder / prompt.entry).is_file():
            with suppress(InputError):
                yield prompt.text, f"data:image/jpeg;base64,{b64encode(read_photo(path)).decode()}"


def _input_texts(results: RunResult, folder: Path) -> dict[str, str]:
    """Return the text of each input that is still what the run was made with.

    Inputs that are missing, or no text, are left out.
    """
    texts = {}
    for file in results.inputs:
        path = folder / Path(file.name).name
        if path.is_file() and path.stat().st_size <= _LARGEST_INPUT:
            content = path.read_bytes()
            if hashlib.sha256(content).hexdigest() == file.sha256:
                texts[f"{file.kind}: {file.name}"] = content.decode("utf-8", "replace")
    return texts


def _text(text: str) -> Markup:
    return escape("\n".join(show.printable(line, _LONGEST_SENTENCE) for line in text.expandtabs(4).splitlines()))


def _finalize(value: object) -> object:
    """Take control characters and endless names out of what goes into the page."""
    return show.printable(value, _LONGEST_NAME) if isinstance(value, str) and not isinstance(value, Markup) else value


def _sentence(text: str) -> Markup:
    return escape(show.printable(text, _LONGEST_SENTENCE))


def _highest(exceedances: tuple[Exceedance, ...]) -> list[Exceedance]:
    highest = sorted(exceedances, key=lambda e: abs(e.peak) - e.limit, reverse=True)[:_MOST_EXCEEDANCES]
    return sorted(highest, key=lambda e: e.start_s)


def _no_exceedance(results: RunResult, *, has_friction: bool) -> str:
    """Return what it means that a run has no exceedance."""
    if results.bench.outcome is not BenchOutcome.OK:
        return "None was seen, but the run was not finished. It does not show that friction keeps its limits."
    if not has_friction:
        return "Not judged: no friction torque was estimated in this run."
    if all(one is None or one.limit_high is None for one in map(results.measurements.get, KINDS)):
        return "Not judged: no limit of friction torque applies to this run."
    return "None: clear of the stops, in the phases that are judged, the estimated friction never passed a limit."


def _id(one: Measurement) -> Markup:
    """Return the id of a measurement, empty where the name says the same.

    The id may break at an underscore.
    """
    shown_id = one.id if shown.says_more(one.id, one.name) else ""
    return Markup("_<wbr>").join(escape(show.printable(shown_id, _LONGEST_PHRASE)).split("_"))


_FILTERS: dict[str, Callable[..., Any]] = {
    "plain": shown.plain,
    "value": shown.value,
    "interval": shown.interval,
    "limits": shown.limits,
    "share": show.share,
    "seconds": lambda value: shown.quantity(value, "s"),
    "whole": _sentence,
    "unit_text": lambda unit: show.printable(shown.unit_shown(unit), _LONGEST_UNIT),
    "id": _id,
    "long": lambda text: escape(show.printable(text, _LONGEST_PHRASE)),
    "count": lambda value: shown.UNKNOWN if value is None else str(value),
}
