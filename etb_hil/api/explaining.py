"""Explain the differences between a measurement and the simulation.

The causes, the model extended by them, and the gain.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from etb_hil.api.arguments import checked
from etb_hil.api.recordings import Recording, read
from etb_hil.base.deprecation import deprecated
from etb_hil.base.errors import InputError, Problem

if TYPE_CHECKING:
    from etb_hil.diagnosis.limits import Limits
    from etb_hil.discrepancy.answer.consequence import Judge
    from etb_hil.discrepancy.explain import Answer
    from etb_hil.plant.parameters import Model
    from etb_hil.report.chart import Chart
    from etb_hil.results.explained.causes import Cause
    from etb_hil.results.explained.errors import Gain
    from etb_hil.results.explanation import ExplanationResult


class Explanation:
    """The answer of `explain`; `result` is all of it, as `explanation.json` holds it."""

    def __init__(self, answer: Answer) -> None:
        self._answer = answer
        self.result: ExplanationResult = answer.explanation

    @property
    @deprecated("Explanation.data", use="Explanation.result", goes_in="0.3")
    def data(self) -> dict[str, Any]:
        """All of the answer as a dictionary."""
        from etb_hil.results.explanation_file import explanation_as_dict

        return explanation_as_dict(self.result)

    @property
    def verdict(self) -> str:
        """One of adequate, explained, ambiguous, unexplained and insufficient_data."""
        return self.result.verdict

    @property
    def causes(self) -> tuple[Cause, ...]:
        """The accepted causes, the most probable first."""
        return self.result.causes

    @property
    def ambiguity_groups(self) -> tuple[tuple[str, ...], ...]:
        """Groups of causes that the data cannot distinguish, by id.

        There is a group for each accepted cause that has one.
        """
        return tuple((one.id, *one.not_isolable_from) for one in self.causes if one.not_isolable_from)

    @property
    def gain(self) -> Gain | None:
        """By what share the extended model errs less than the calibrated one.

        The error is that of the throttle angle in free run, on data that no fit used. None where it is unknown.
        """
        return self.result.gain

    @property
    def model(self) -> Model | None:
        """The model with what was found; None where nothing was fitted.

        `simulate` and `Model.write` take it.
        """
        return self._answer.model

    @checked
    def write(self, folder: str | Path, inputs: Sequence[Path] = (), *, pictures: bool = False) -> list[Path]:
        """Write the answer's files into a folder; return their paths.

        They are explanation.json, model.yaml, the next test and explanation.html.

        `inputs`: the files and sessions that it was made from, whose names and hashes the page then has. With
        `pictures` the plots of the page are PNG files, too.
        """
        from etb_hil.discrepancy.explain import write
        from etb_hil.report.explain_report import write_explanation

        to = Path(folder)
        written = write(self._answer, to)
        return [
            *written,
            write_explanation(self._answer.explanation, self._pictures(), to, inputs, pictures=pictures),
        ]

    def figure(self) -> Any:  # noqa: ANN401 (matplotlib is loaded when drawn)
        """Return a matplotlib figure of the part that the model gets most wrong.

        The figure shows that before and after; None where there is none.
        """
        from etb_hil.report.drawing import figure_of

        chart = self._chart()
        return None if chart is None else figure_of(chart)

    def _chart(self) -> Chart | None:
        from etb_hil.report.explain_plots import before_and_after

        series = self._pictures()
        return None if series is None else before_and_after(series)

    def residual_figures(self) -> list[Any]:
        """Return matplotlib figures of what the model lacks, before and after.

        They are drawn over angle, speed and so on.
        """
        from etb_hil.report.drawing import figure_of
        from etb_hil.report.explain_plots import residual_plot

        series = self._pictures()
        return [] if series is None else [figure_of(residual_plot(left)) for left in series.left]

    def _pictures(self) -> Any:  # noqa: ANN401 (its module draws nothing, and takes its time to load)
        from etb_hil.discrepancy.answer.pictures import coarse_pictures, pictures

        answer = self._answer
        if answer.findings and answer.holdout:
            return pictures(answer.findings, answer.holdout)
        return coarse_pictures(answer.coarse) if answer.coarse else None

    def __repr__(self) -> str:
        return f"Explanation(verdict={self.verdict!r}, causes={[one.id for one in self.causes]})"

    def _repr_html_(self) -> str:
        from etb_hil.api.html import page, table
        from etb_hil.report.residual_text import residual_text

        rows = []
        for one in self.causes:
            sizes = "; ".join(
                f"{name} {size.value:.4g} {size.unit} ({size.low:.4g} to {size.high:.4g})".replace(" 1 (", " (")
                for name, size in one.parameters.items()
            )
            rows.append((one.id, ", ".join(one.not_isolable_from), f"{one.share_of_error:.0%}", sizes))
        causes = table(("cause", "or", "share of the error", "sizes (95 %)"), rows) if rows else ""
        notes = [left] if (left := residual_text(self.result)) else []
        return page(self.verdict.replace("_", " "), causes, notes, self._chart())


@checked
def explain(
    recordings: Recording | str | Path | Sequence[Recording | str | Path],
    model: Model | str | Path | None = None,
    *,
    limits: Limits | str | Path | None = None,
    fit_on: Sequence[float] = (),
    is_same_unit: bool = False,
    progress: Callable[[str], None] = lambda _: None,
) -> Explanation:
    """Explain what a model gets wrong of a recording.

    The recording is the first of those given; the causes are tried on the others.

    A recording may be a path that `read` takes by itself. `model` is by default that of the first one's session;
    `limits` are by default those of the session, else the stock ones. `is_same_unit`: all are of one unit, so that what
    any of them distinguishes is distinguished. `fit_on`: of data too slow to name causes by, the conditions whose runs
    are fitted. `progress` is told what is being done. Raises InputError where data and model do not fit; an interrupt
    ends the search with what is known by then.
    """
    from threadpoolctl import threadpool_limits

    from etb_hil.api.models import as_limits, as_model
    from etb_hil.discrepancy.explain import explain as search
    from etb_hil.scenario.planning import stock_plans

    several = [recordings] if isinstance(recordings, Recording | str | Path) else recordings
    given = [read(one) if isinstance(one, str | Path) else one for one in several]
    if not given:
        raise InputError(Problem("there is nothing to explain", remedy="give a recording, or a path"))
    session = given[0].session
    known = as_model(model_of(session) if model is None else model)
    allowed = as_limits(limits_of(session) if limits is None else limits)
    # The search has threads of its own; those of BLAS, which wait for each other busily, cost three times its time.
    with threadpool_limits(1, "blas"), _naming_plugins():
        answer = search(
            given,
            known,
            progress=progress,
            limits=allowed,
            judge=None if session is None else _bench_of(session, allowed),
            plans=(lambda: stock_plans(known.values)) if known.device.is_throttle else None,
            fit_on=fit_on,
            is_same_unit=is_same_unit,
        )
    return Explanation(answer)


@contextmanager
def _naming_plugins() -> Iterator[None]:
    """Turn a failure of the search's arithmetic into an InputError.

    It names the effects of plug-ins, which took part in the search; without any the failure stays as it is.
    """
    from etb_hil.base.plugins import first_line, parts

    try:
        yield
    except InputError:
        raise
    except (ArithmeticError, ValueError) as error:
        found = parts("effects")
        if not found:
            raise
        what = f"the search failed with it: {first_line(error)}"
        raise InputError(*(problem for part in found for problem in part.refused(what).problems)) from error


def model_of(session: Path | None) -> Path:
    """Return the model that a session's bench had of its unit.

    InputError where there is no session.
    """
    from etb_hil.session.session import open_session

    if session is None:
        what = "no session says what is known of the unit"
        raise InputError(Problem(what, allowed="a model file, or a stock one such as default", remedy="name its model"))
    return open_session(session).input_path("model")


def limits_of(session: Path | None) -> Path | str:
    """Return the limits that a session was judged by, or the name of the stock ones."""
    from etb_hil.session.session import open_session

    return "default" if session is None else open_session(session).input_path("limits")


def _bench_of(session: Path, limits: Limits) -> Judge:
    """Return how the bench judges a session of its own again."""
    from etb_hil.replays.session_replay import judged_under

    return lambda model: judged_under(session, model, limits)
