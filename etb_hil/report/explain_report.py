"""The page of an explanation, and its plots."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from markupsafe import Markup

from etb_hil import __version__
from etb_hil.base.files import write_text
from etb_hil.discrepancy.answer.folder import WRITTEN
from etb_hil.discrepancy.answer.pictures import Pictures
from etb_hil.report import explain_plots
from etb_hil.report.explain_causes import candidate_row, cause_rows, is_refitted, model_file_text, moved_parameters
from etb_hil.report.explain_data import detection_rows, detection_text, friction_rows, judged_sentences, quality_row
from etb_hil.report.explain_errors import CALLED, error_rows, gain_text, run_rows, shown_models, variance_text
from etb_hil.report.explain_next_test import next_test_text
from etb_hil.report.explain_verdict import TONES, further_sentences, named_causes, reason
from etb_hil.report.page_template import ours, render
from etb_hil.report.svg import drawings_of
from etb_hil.results.explanation import ExplanationResult
from etb_hil.results.explanation_file import EXPLANATION_PAGE

_PICTURES = (
    "before_and_after",
    "over_runs",
    *(
        f"{balance}_over_{over}"
        for balance in ("torque", "force", "voltage", "angle")
        for over in ("position", "motor_turn", "velocity", "time", "temperature", "current")
    ),
)
REPORT_FILES = (EXPLANATION_PAGE, *(f"{name}.png" for name in _PICTURES))


def write_explanation(
    found: ExplanationResult,
    series: Pictures | None,
    folder: Path,
    inputs: Sequence[Path] = (),
    *,
    pictures: bool = False,
) -> Path:
    """Write `explanation.html`; return its path.

    With `pictures` each plot is a PNG file, too.

    The folder exists.

    `inputs` are the files and sessions that it was made from. Each is shown with its folder: two may have one name.
    """
    for name in _PICTURES:  # an earlier answer's are not of these data
        (folder / f"{name}.png").unlink(missing_ok=True)
    drawn: list[tuple[str, Markup]] = []
    if series is not None:
        plots = {"before_and_after": explain_plots.before_and_after(series)}
        for left in series.left:
            plots[f"{left.balance}_over_{left.over}".replace(" ", "_")] = explain_plots.residual_plot(left)
        if series.runs is not None:
            plots["over_runs"] = explain_plots.over_runs(series.runs)
        drawn = [(name, ours(drawings_of(chart, name))) for name, chart in plots.items()]
        if pictures:
            from etb_hil.report.drawing import figure_of, save_png  # noqa: PLC0415 (matplotlib takes its time to load)

            for name, chart in plots.items():
                save_png(figure_of(chart), folder / f"{name}.png")
    return write_text(folder / EXPLANATION_PAGE, _page(found, drawn, folder, inputs))


def _page(found: ExplanationResult, drawn: list[tuple[str, Markup]], folder: Path, inputs: Sequence[Path]) -> str:
    verdict = found.verdict
    return render(
        "explain.html.jinja",
        headline=verdict.replace("_", " ").upper(),
        tone=TONES[verdict],
        named=named_causes(found),
        reason=reason(found),
        further=further_sentences(found),
        next_test=next_test_text(found),
        causes=[row for cause in found.causes for row in cause_rows(cause, is_refitted=is_refitted(found))],
        model_file=model_file_text(found),
        drawn=drawn,
        models=[CALLED.get(name, name) for name in shown_models(found)],
        errors=error_rows(found),
        gain=gain_text(found),
        variance=variance_text(found),
        candidates=[candidate_row(one, found.causes) for one in found.candidates],
        moved=moved_parameters(found),
        runs=run_rows(found),
        friction=friction_rows(found),
        judged=judged_sentences(found),
        quality=[quality_row(one) for one in found.data_quality],
        smallest=detection_rows(found),
        limits=detection_text(found),
        written=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
        version=__version__,
        inputs=[(str(Path(*path.parts[-2:])), _hash(path)) for path in inputs],
        links=[name for name in WRITTEN if (folder / name).is_file()],
    )


def _hash(path: Path) -> str:
    """Return the SHA-256 of a file, or of a session's description."""
    file = path / "session.json" if path.is_dir() else path
    return hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else ""
