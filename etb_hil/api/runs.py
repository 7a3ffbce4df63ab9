"""Run a scenario on a bench, or judge its session or a log again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from etb_hil.api.arguments import checked
from etb_hil.api.recordings import Recording

if TYPE_CHECKING:
    from etb_hil.base.outcome import ExitCode, UnitVerdict
    from etb_hil.recording.samples import Float64
    from etb_hil.report.chart import Chart
    from etb_hil.results.measurement import Measurements
    from etb_hil.results.run_result import RunResult
    from etb_hil.session.finished import Finished


class Run:
    """A run that was judged.

    `result` is what `results.json` holds, `folder` the session's (of a log: the one it lies in). `warnings` are
    sentences on what could not be done with the results, such as a store that could not be written.
    """

    def __init__(self, finished: Finished) -> None:
        self._finished = finished
        self.result: RunResult = finished.results
        self.folder: Path = finished.session.folder
        self.warnings: tuple[str, ...] = finished.warnings

    @classmethod
    @checked
    def open(
        cls,
        session: str | Path,
        *,
        model: str | Path | None = None,
        limits: str | Path | None = None,
        observer: str | None = None,
    ) -> Run:
        """Judge a session's folder again.

        Its own model, limits and observer apply where none are given.

        Raises InputError where the folder is no session, or was changed since the run.
        """
        from etb_hil.base.stock import find
        from etb_hil.replays.session_replay import replay

        return cls(
            replay(
                Path(session),
                None if model is None else find("model", str(model)),
                None if limits is None else find("limits", str(limits)),
                observer=observer,
            )
        )

    @property
    def verdict(self) -> UnitVerdict | None:
        """The verdict on the unit: pass, fail or inconclusive.

        None where the bench failed or the run was aborted.
        """
        return self.result.unit.verdict

    @property
    def reason(self) -> str:
        """Why the verdict is what it is, in a sentence."""
        from etb_hil.report.verdict import verdict_of

        return verdict_of(self.result).reason

    @property
    def code(self) -> ExitCode:
        """The exit code that the command line has for this run; 0 is a pass."""
        return self.result.code

    @property
    def measurements(self) -> Measurements:
        """What was measured, by id: `run.measurements["T_st"].interval`."""
        return self.result.measurements

    @cached_property
    def recording(self) -> Recording:
        """The signals of the run."""
        return Recording.of(self._finished.analysis.recording)

    @property
    def series(self) -> Mapping[str, Float64]:
        """Columns that the report draws, in SI.

        They are traces every millisecond, points and curve of friction over speed.
        """
        return self._finished.series

    def figure(self) -> Any:  # noqa: ANN401 (matplotlib is loaded when drawn)
        """Return a matplotlib figure of friction over speed, with curve and limits."""
        from etb_hil.report.drawing import figure_of

        return figure_of(self._chart())

    def _chart(self) -> Chart:
        from etb_hil.report.plots import friction_over_speed
        from etb_hil.report.series import ReportSeries

        return friction_over_speed(ReportSeries.from_mapping(self.series), self.result)

    @checked
    def report(self, folder: str | Path | None = None) -> Path:
        """Write `report.html` into a folder (the session's), and return its path."""
        from etb_hil.base.files import make_folder
        from etb_hil.report.html_report import write_report

        return write_report(self.result, self.series, make_folder(Path(folder) if folder else self.folder))

    def __repr__(self) -> str:
        return f"Run({self.result.run_id!r}, verdict={self.verdict and str(self.verdict)!r})"

    def __str__(self) -> str:
        """Return the verdict as the command line prints it."""
        from etb_hil.report.verdict import verdict_text

        return verdict_text(self.result)

    def _repr_html_(self) -> str:
        from etb_hil.api.html import measurements, page
        from etb_hil.report.verdict import verdict_of

        verdict = verdict_of(self.result)
        about = f"{verdict.headline}: {verdict.reason}"
        return page(about, measurements(self.measurements), self.warnings, self._chart())


@checked
def run(
    scenario: str | Path = "friction_check",
    *,
    bench: str | Path = "virtual_classic",
    unit: str | Path | None = None,
    model: str | Path = "default",
    limits: str | Path = "default",
    dbc: str | Path | None = None,
    observer: str | None = None,
    serial: str = "",
    seed: int = 1,
    folder: str | Path = "sessions",
) -> Run:
    """Run a scenario on a bench, keep its session, and judge the unit.

    The session lies in a new folder under `folder`.

    Files are paths, or names of stock ones. `unit` is the virtual unit's model, `seed` that of its noise; a real bench
    has neither. Prompts are answered as the scenario says. A bench that fails gives no verdict: see `result.bench`.
    Raises InputError where files are wrong or do not fit, before anything moves.
    """
    from etb_hil.base.stock import find
    from etb_hil.bench.job import JobFiles, deliver, execute, prepare

    files = JobFiles(
        find("scenario", str(scenario)),
        find("bench", str(bench)),
        find("model", str(model)),
        find("limits", str(limits)),
        None if unit is None else find("model", str(unit)),
        None if dbc is None else find("dbc", str(dbc)),
        observer=observer,
    )
    job = prepare(files)
    finished = execute(job, Path(folder), serial, seed)
    late = deliver(job, Path(folder))
    return Run(replace(finished, warnings=(*finished.warnings, *late)))
