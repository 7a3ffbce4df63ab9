"""Make the result of a run from what was recorded; a replay gives the same."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from etb_hil.base.outcome import BenchOutcome, SafeState, exit_code
from etb_hil.base.plugins import plugins
from etb_hil.bench.controller_needs import not_watched
from etb_hil.bench.wording import bench_wording, unit_wording
from etb_hil.results import run_result
from etb_hil.results.run_result import RunResult
from etb_hil.session.answer_time import answer_time
from etb_hil.session.clock_grade import grade_clock
from etb_hil.session.session import versions
from etb_hil.session.set_point_jitter import set_point_jitter

if TYPE_CHECKING:
    from etb_hil.bench.bench_file import Bench
    from etb_hil.diagnosis.exceedance import Exceedance
    from etb_hil.diagnosis.limits import Limits
    from etb_hil.diagnosis.result import DiagnosisResult
    from etb_hil.scenario.condition_watch import Firing
    from etb_hil.session.analysis import Analysis
    from etb_hil.session.record import PhaseTime, RunRecord
    from etb_hil.session.session import Session


def results_of(
    session: Session, bench: Bench, limits: Limits, record: RunRecord, analysis: Analysis, found: DiagnosisResult
) -> RunResult:
    """Return the result of a run; times in seconds since it began."""
    if analysis.fault is not None and record.outcome is BenchOutcome.OK:  # after the last look at it, or in a log
        fault = analysis.fault
        record = replace(record, outcome=BenchOutcome.FAULT, reason_id=fault.reason_id, reason=str(fault))
    results = _without_words(session, bench, limits, record, analysis, found)
    unit, its_bench = results.unit, results.bench
    if record.outcome is BenchOutcome.OK:
        return replace(results, unit=replace(unit, next_step=unit_wording(results).next_step))
    return replace(results, bench=replace(its_bench, next_step=bench_wording(results).next_step))


def _without_words(
    session: Session, bench: Bench, limits: Limits, record: RunRecord, analysis: Analysis, found: DiagnosisResult
) -> RunResult:
    return RunResult(
        run_id=session.run_id,
        unit=_unit(session, limits, record, found),
        bench=_bench(bench, record, analysis),
        started=session.started,
        scenario=session.scenario,
        model=session.model,
        seed=session.seed,
        duration_s=(record.end_ns - record.start_ns) * 1e-9,
        exit_code=int(exit_code(record.outcome, found.verdict)),
        timestamp_grade=str(analysis.recording.clock),
        clock=grade_clock(analysis.recording),
        measurements=found.measurements,
        exceedances=tuple(_exceedance(episode, record) for episode in found.exceedances),
        phases=tuple(
            _phase(phase, fired, record.start_ns) for phase, fired in zip(record.phases, analysis.firings, strict=True)
        ),
        prompts=tuple(
            run_result.Prompt(
                said.id, said.text, said.answer, said.by, (said.stamp_ns - record.start_ns) * 1e-9, said.entry
            )
            for said in record.answers
        ),
        unit_diagnostics=record.diagnostics,
        bus=_bus(bench, record, analysis),
        versions=versions(),
        plugins=plugins(),
        inputs=session.inputs,
    )


def _unit(session: Session, limits: Limits, record: RunRecord, found: DiagnosisResult) -> run_result.Unit:
    whose = (session.serial, limits.part_number, limits.revision)
    if record.outcome is not BenchOutcome.OK:
        return run_result.Unit(None, "run_not_finished", "", "", (), *whose)
    first, *others = found.reasons
    also = tuple(reason.id for reason in others)
    return run_result.Unit(found.verdict, first.id, first.text, "", also, *whose)


def _bench(bench: Bench, record: RunRecord, analysis: Analysis) -> run_result.Bench:
    return run_result.Bench(
        record.outcome,
        record.reason_id,
        record.reason,
        safe_state=record.safe_state is SafeState.VERIFIED,
        name=bench.name,
        lateness=run_result.Lateness(record.late_mean_ns * 1e-6, record.late_worst_ns * 1e-6),
        frame_age=run_result.FrameAge(record.age_mean_ns * 1e-6, record.age_worst_ns * 1e-6),
        answer_time=answer_time(analysis.recording),
        set_point_jitter=set_point_jitter(analysis.recording, bench.command_rate, _pauses(record)),
        not_watched=tuple(not_watched(analysis.dialect)),
        readings=analysis.quality(),
    )


def _pauses(record: RunRecord) -> list[tuple[int, int]]:
    """Return when the unit ran routines of its own, in ns."""
    routines = () if record.diagnostics is None else record.diagnostics.routines
    origin = record.start_ns
    return [(origin + round(one.start_s * 1e9), origin + round(one.end_s * 1e9)) for one in routines]


def _exceedance(episode: Exceedance, record: RunRecord) -> run_result.Exceedance:
    return run_result.Exceedance(
        episode.kind,
        (episode.start_ns - record.start_ns) * 1e-9,
        (episode.end_ns - record.start_ns) * 1e-9,
        episode.peak,
        episode.limit,
        episode.angle,
        episode.velocity,
        None if math.isnan(episode.temperature) else episode.temperature,
        _phase_at(episode.start_ns, record),
        episode.allowance,
    )


def _phase_at(time_ns: int, record: RunRecord) -> str:
    """Return the id of the phase that a time of the run lies in."""
    return next((phase.id for phase in reversed(record.phases) if phase.start_ns <= time_ns), "")


def _phase(phase: PhaseTime, fired: Firing | None, origin_ns: int) -> run_result.Phase:
    return run_result.Phase(
        phase.id,
        phase.kind.replace("_", " "),
        (phase.start_ns - origin_ns) * 1e-9,
        None if phase.end_ns is None else (phase.end_ns - origin_ns) * 1e-9,
        "stopped" if phase.end_ns is None else str(phase.end),
        None if fired is None else (fired.stamp_ns - origin_ns) * 1e-9,
        None if fired is None else fired.value,
    )


def _bus(bench: Bench, record: RunRecord, analysis: Analysis) -> run_result.Bus:
    health = record.health
    return run_result.Bus(
        f"{bench.bus.interface} {bench.bus.channel}",
        load=health.get("load"),
        load_peak=health.get("peak_load"),
        error_frames=health.get("error_frames"),
        dropped=health.get("dropped"),
        state=health.get("state"),
        transmit_errors=health.get("transmit_errors"),
        receive_errors=health.get("receive_errors"),
        messages=tuple(
            run_result.MessageStatistics(
                name,
                counted.frames,
                None if counted.unknown else counted.lost,
                counted.crc_failures,
                counted.counter_jumps,
                counted.repeated,
            )
            for name, counted in analysis.decoder.statistics().items()
        ),
    )
