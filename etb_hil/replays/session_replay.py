"""Judge a session again: frames and events, through the same analysis as live."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.plugins import missing
from etb_hil.base.userfile import digest
from etb_hil.bench.bench_file import load_bench
from etb_hil.bench.results import results_of
from etb_hil.canio.logs.blf import read_blf
from etb_hil.observer.registry import OBSERVERS
from etb_hil.plant.parameters import load_model
from etb_hil.replays.window import within
from etb_hil.results.run_result import InputFile
from etb_hil.scenario.judged_limits import load_judged_limits
from etb_hil.scenario.scenario_file import load_scenario
from etb_hil.session.analysis import Analysis
from etb_hil.session.attempts import earlier_attempts
from etb_hil.session.checksum import CHANGED
from etb_hil.session.finished import Finished
from etb_hil.session.record import CUT_SHORT, read_record
from etb_hil.session.session import Session, open_session

if TYPE_CHECKING:
    from etb_hil.bench.bench_file import BenchSetup
    from etb_hil.diagnosis.limits import Limits
    from etb_hil.diagnosis.result import DiagnosisResult
    from etb_hil.plant.parameters import Model
    from etb_hil.replays.window import Window
    from etb_hil.scenario.condition import Condition
    from etb_hil.session.record import RunRecord


@dataclass(frozen=True, slots=True)
class RuleFiles:
    """The files that a verdict rests on.

    Without `dbc`, it is the one that the bench file names, as is the observer.
    """

    bench: Path
    model: Path
    limits: Path
    dbc: Path | None = None
    observer: str | None = None

    def read(self) -> Rules:
        """Read and check them; InputError lists what is wrong."""
        setup = load_bench(self.bench, self.dbc)
        observer = self.observer or setup.bench.observer
        OBSERVERS.require(observer)
        return Rules(setup, load_model(self.model), load_judged_limits(self.limits), observer)

    def absolute(self) -> RuleFiles:
        """Return the same files, as a process that stands in another folder finds them."""
        return RuleFiles(
            self.bench.absolute(),
            self.model.absolute(),
            self.limits.absolute(),
            self.dbc and self.dbc.absolute(),
            self.observer,
        )

    def inputs(self) -> tuple[InputFile, ...]:
        """Return the files as a session's manifest lists them."""
        paths = {"bench": self.bench, "model": self.model, "limits": self.limits, "dbc": self.dbc}
        return tuple(InputFile(kind, path.name, digest(path)) for kind, path in paths.items() if path is not None)


@dataclass(frozen=True, slots=True)
class Rules:
    """What a verdict rests on, read."""

    setup: BenchSetup
    model: Model
    limits: Limits
    observer: str


def rule_files(
    session: Session, model: Path | None = None, limits: Path | None = None, observer: str | None = None
) -> RuleFiles:
    """Return the files that a session was judged by.

    Another model, limits file or observer takes its place where it is given.
    """
    return RuleFiles(
        session.input_path("bench"),
        model or session.input_path("model"),
        limits or session.input_path("limits"),
        session.input_path("dbc"),
        observer or session.observer,
    )


def replay(
    folder: Path,
    model: Path | None = None,
    limits: Path | None = None,
    window: Window | None = None,
    observer: str | None = None,
) -> Finished:
    """Judge a recorded session again.

    With its own inputs, the results are those of the live run.

    `model`, `limits` and `observer` take the place of the session's own; of a `window`, nothing else is read.
    """
    session = open_session(folder)
    _require_untouched(session)
    absent = missing(session.plugins)
    try:
        finished = _replayed(session, model, limits, window, observer)
    except InputError as error:  # it may name what a plug-in had
        raise InputError(*error.problems, *absent) from error
    return replace(finished, warnings=absent)


def _replayed(
    session: Session, model: Path | None, limits: Path | None, window: Window | None, observer: str | None
) -> Finished:
    files = rule_files(session, model, limits, observer)
    if model or limits:
        kept = tuple(entry for entry in session.inputs if entry.kind in {"scenario", "unit"})
        session = replace(session, inputs=(*kept, *files.inputs()))
    rules = files.read()
    if model:
        session = replace(session, model=rules.model.name)
    session = replace(session, observer=rules.observer)
    record, analysis, found = _judged(session, rules, window)
    results = results_of(session, rules.setup.bench, rules.limits, record, analysis, found)
    results = replace(results, attempts=earlier_attempts(session))
    return Finished(session, results, record, analysis, found)


def judged_under(folder: Path, model: Model, limits: Limits) -> DiagnosisResult:
    """Judge a recorded session as `replay` does, under a model that no file has."""
    session = open_session(folder)
    rules = replace(rule_files(session).read(), model=model, limits=limits)
    return _judged(session, rules, None)[2]


def _judged(session: Session, rules: Rules, window: Window | None) -> tuple[RunRecord, Analysis, DiagnosisResult]:
    record = record_of(session)
    analysis = Analysis(
        rules.setup.dialect,
        rules.model,
        rules.limits,
        str(session.folder),
        observer=rules.observer,
        bus=rules.setup.bench.bus,
    )
    conditions = conditions_of(session)
    for phase in record.phases:
        analysis.begin_phase(phase.start_ns, phase.id, phase.kind, conditions.get(phase.id))
    log = read_blf(session.raw_log)
    for frames in within(log, window, session.raw_log):
        analysis.push(frames)
    if record.reason_id != CUT_SHORT and session.frames_are_changed():
        log.notes.append(f"{session.raw_log}: {CHANGED}")
    analysis.recording.notes += log.notes
    return record, analysis, analysis.finish(complete=record.is_complete and not log.notes)


def record_of(session: Session) -> RunRecord:
    """Return the record of a session; one whose end is not known was cut short."""
    record = read_record(session.events)  # which names a damaged line, before a checksum says that the file was changed
    return record if session.end_is_known() else read_record(session.events, end_is_known=False)


def conditions_of(session: Session) -> dict[str, Condition | None]:
    """Return what ends each phase of a session's scenario, where something does.

    Own code has no scenario.
    """
    if not any(entry.kind == "scenario" for entry in session.inputs):
        return {}
    scenario = load_scenario(session.input_path("scenario")).content
    return {step.id: step.phase.until for step in scenario.steps}


def _require_untouched(session: Session) -> None:
    """Refuse a session whose copies of the inputs were changed.

    A verdict rests on them.
    """
    changed = [
        Problem(
            f"the session's {entry.kind} file is not the one that the run was made with",
            Place(session.input_path(entry.kind)),
            remedy="restore it; to judge by other files, give them to replay with --model or --limits",
        )
        for entry in session.inputs
        if digest(session.input_path(entry.kind), "restore the file") != entry.sha256
    ]
    if changed:
        raise InputError(*changed)
