"""Judge a recording: friction and all else that it tells, against limits."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from etb_hil.api.arguments import checked
from etb_hil.base.errors import InputError, Problem
from etb_hil.diagnosis.result import DiagnosisResult

if TYPE_CHECKING:
    from etb_hil.diagnosis.limits import Limits
    from etb_hil.plant.parameters import Model
    from etb_hil.recording.recording import Recording
    from etb_hil.report.chart import Chart

NEEDED = ("motor_current", "motor_angle")


class Judgement(DiagnosisResult):
    """What a recording says of the unit.

    The judgement has `verdict`, `reasons` (the first decided), `measurements` and `exceedances`.
    """

    __slots__ = ()

    def figure(self) -> Any:  # noqa: ANN401 (matplotlib is loaded when drawn)
        """Return a matplotlib figure of friction over speed, with curve and limits."""
        from etb_hil.report.drawing import figure_of

        return figure_of(self._chart())

    def _chart(self) -> Chart:
        from etb_hil.base.outcome import BenchOutcome
        from etb_hil.report.plots import friction_over_speed
        from etb_hil.report.series import ReportSeries
        from etb_hil.results.run_result import Bench, RunResult, Unit

        results = RunResult("", Unit(self.verdict), Bench(BenchOutcome.OK), measurements=self.measurements)
        return friction_over_speed(ReportSeries.from_mapping(self.series), results)

    def _repr_html_(self) -> str:
        from etb_hil.api.html import measurements, page

        about = f"{str(self.verdict).upper()}: {'; '.join(reason.text for reason in self.reasons[:1])}"
        further = [reason.text for reason in self.reasons[1:]]
        return page(about, measurements(self.measurements), further, self._chart())


@checked
def diagnose(
    recording: Recording,
    *,
    model: Model | str | Path = "default",
    limits: Limits | str | Path = "default",
    observer: str | None = None,
) -> Judgement:
    """Judge the unit in a recording as a log without phases.

    All of it is taken for motion under the bridge.

    Needs the roles `motor_current` and `motor_angle`. A session has phases, which `Run.open` and `replay` go by: of its
    recording alone the zero of the current is not known. Raises InputError where a role is missing or a file is wrong.
    """
    from etb_hil.api.models import as_limits, as_model
    from etb_hil.diagnosis.diagnosis import Diagnosis
    from etb_hil.diagnosis.phase_use import RunPhase, Use
    from etb_hil.diagnosis.plausibility import Plausibility
    from etb_hil.observer.registry import DEFAULT
    from etb_hil.recording.samples import Joiner
    from etb_hil.scenario.phases import LOG
    from etb_hil.session.analysis import SLOW_ROLES
    from etb_hil.session.sample_hold import SampleHold
    from etb_hil.session.verdict_policy import withheld

    judged_by = as_model(model)
    if missing := [role for role in NEEDED if role not in recording.roles]:
        what = f"{recording.origin} needs {' and '.join(missing)} to measure friction"
        raise InputError(Problem(what, allowed=", ".join(NEEDED), remedy="name its column in a map file"))
    diagnosis = Diagnosis(judged_by, as_limits(limits), observer or DEFAULT)
    plausibility = Plausibility(judged_by)
    joined = list(dict.fromkeys(recording.source_of(role) for role in NEEDED))
    slow = {role: recording.source_of(role) for role in SLOW_ROLES if role in recording.roles}
    samples = SampleHold(Joiner(joined), slow).push(recording.block(source) for source in recording.sources)
    if samples is not None:
        diagnosis.push(samples, RunPhase(0, LOG, LOG, Use.FITTED))
        plausibility.push(samples, 0, moving=True)
    found = withheld(diagnosis.finish(), plausibility.doubts())
    return Judgement(**{field.name: getattr(found, field.name) for field in fields(found)})
