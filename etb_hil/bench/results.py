"""What `results.json` says of a run: made from what was recorded alone, so that a replay writes the same."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from etb_hil.base.outcome import BenchOutcome, SafeState, UnitVerdict, exit_code
from etb_hil.bench.controller_needs import not_watched
from etb_hil.session.answer_time import answer_time
from etb_hil.session.clock_grade import grade_clock
from etb_hil.session.session import versions
from etb_hil.session.set_point_jitter import set_point_jitter

if TYPE_CHECKING:
    from etb_hil.bench.bench_file import Bench
    from etb_hil.diagnosis.limits import Limits
    from etb_hil.diagnosis.result import DiagnosisResult
    from etb_hil.scenario.condition_watch import Firing
    from etb_hil.session.analysis import Analysis
    from etb_hil.session.record import PhaseTime, RunRecord
    from etb_hil.session.session import Session

SCHEMA_VERSION = 1


def results_of(
    session: Session, bench: Bench, limits: Limits, record: RunRecord, analysis: Analysis, found: DiagnosisResult
) -> dict[str, Any]:
    """Return the contents of `results.json`; times in seconds since the run began."""
    judged = record.outcome is BenchOutcome.OK
    verdict = found.verdict if judged else None
    plain = found.as_dict(record.start_ns)
    return {
        "schema_version": SCHEMA_VERSION,
        "run_id": session.run_id,
        "started": session.started,
        "scenario": session.scenario,
        "model": session.model,
        "seed": session.seed,
        "duration_s": (record.end_ns - record.start_ns) * 1e-9,
        "exit_code": int(exit_code(record.outcome, verdict)),
        "unit": {
            "verdict": verdict,
            "reason_id": plain["reason_id"] if judged else "run_not_finished",
            "reason": plain["reason"] if judged else "",
            "next_step": plain["next_step"] if judged else "",
            "also": plain["also"] if judged else [],
            "serial": session.serial,
            "part_number": limits.part_number,
            "revision": limits.revision,
        },
        "bench": {
            "outcome": record.outcome,
            "reason_id": record.reason_id,
            "reason": record.reason,
            "safe_state": record.safe_state is SafeState.VERIFIED,
            "name": bench.name,
            "lateness": {"worst_ms": record.late_worst_ns * 1e-6, "mean_ms": record.late_mean_ns * 1e-6},
            "frame_age": {"worst_ms": record.age_worst_ns * 1e-6, "mean_ms": record.age_mean_ns * 1e-6},
            "answer_time": answer_time(analysis.recording),
            "not_watched": not_watched(analysis.dialect),
            "set_point_jitter": set_point_jitter(analysis.recording, bench.command_rate),
        },
        "timestamp_grade": str(analysis.recording.clock),
        "clock": asdict(grade_clock(analysis.recording)),
        "numbers": plain["numbers"],
        "exceedances": [each | {"phase": _phase_at(each["start_s"], record)} for each in plain["exceedances"]],
        "phases": [
            _phase(phase, fired, record.start_ns) for phase, fired in zip(record.phases, analysis.firings, strict=True)
        ],
        "prompts": [
            {
                "id": said.id,
                "text": said.text,
                "answer": said.answer,
                "by": said.by,
                "answered_s": (said.stamp_ns - record.start_ns) * 1e-9,
            }
            for said in record.answers
        ],
        "attempts": [],
        "bus": _bus(bench, record, analysis),
        "versions": versions(),
        "inputs": [asdict(entry) for entry in session.inputs],
    }


def verdict_of(results: dict[str, Any]) -> tuple[BenchOutcome, UnitVerdict | None]:
    """Return the two outcomes of a results file."""
    unit = results["unit"]["verdict"]
    return BenchOutcome(results["bench"]["outcome"]), None if unit is None else UnitVerdict(unit)


def _phase_at(time_s: float, record: RunRecord) -> str:
    """Return the id of the phase that a time of the run lies in."""
    time_ns = record.start_ns + round(time_s * 1e9)
    return next((phase.id for phase in reversed(record.phases) if phase.start_ns <= time_ns), "")


def _phase(phase: PhaseTime, fired: Firing | None, origin_ns: int) -> dict[str, Any]:
    return {
        "id": phase.id,
        "name": phase.kind.replace("_", " "),
        "start_s": (phase.start_ns - origin_ns) * 1e-9,
        "end_s": None if phase.end_ns is None else (phase.end_ns - origin_ns) * 1e-9,
        "outcome": "stopped" if phase.end_ns is None else phase.end,
        "trigger_s": None if fired is None else (fired.stamp_ns - origin_ns) * 1e-9,
        "trigger_value": None if fired is None else fired.value,
    }


def _bus(bench: Bench, record: RunRecord, analysis: Analysis) -> dict[str, Any]:
    health = record.health
    messages = [
        {
            "name": name,
            "frames": counted.frames,
            "lost": None if counted.unknown else counted.lost,
            "crc_failures": counted.crc_failures,
            "counter_jumps": counted.counter_jumps,
            "repeated_counters": counted.repeated,
        }
        for name, counted in analysis.decoder.statistics().items()
    ]
    return {
        "name": f"{bench.bus.interface} {bench.bus.channel}",
        "load": health.get("load"),
        "load_peak": health.get("peak_load"),
        "error_frames": health.get("error_frames"),
        "state": health.get("state"),
        "transmit_errors": health.get("transmit_errors"),
        "receive_errors": health.get("receive_errors"),
        "dropped": health.get("dropped"),
        "messages": messages,
    }
