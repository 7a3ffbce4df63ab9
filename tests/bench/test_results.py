"""The result of a run from its record: times count from its begin, and what the bench ended judges no unit."""

from dataclasses import replace
from functools import cache
from math import nan
from pathlib import Path

import numpy as np
import pytest
from whole_run import files

from etb_hil.base.errors import PartFault
from etb_hil.base.outcome import BenchOutcome, ExitCode, SafeState, UnitVerdict
from etb_hil.bench.job import prepare
from etb_hil.bench.results import results_of
from etb_hil.canio.dbc.writer import MessageWriter
from etb_hil.diagnosis.exceedance import Exceedance
from etb_hil.diagnosis.result import DiagnosisResult, Reason
from etb_hil.recording.samples import SampleBlock
from etb_hil.results import run_result
from etb_hil.results.measurement import Measurements
from etb_hil.results.run_result import FrameAge, Lateness, Phase, Prompt
from etb_hil.results.unit_diagnostics import RoutineRun, UnitDiagnostics
from etb_hil.scenario.condition import Condition
from etb_hil.session.analysis import Analysis
from etb_hil.session.record import Answered, PhaseEnd, PhaseTime, RunRecord
from etb_hil.session.session import Session

MS = 1_000_000
START = 7_000 * MS
RECORD = RunRecord(
    START,
    START + 4_000 * MS,
    phases=[
        PhaseTime("zero", "current_zero", START + 500 * MS, START + 1_000 * MS),
        PhaseTime("wait", "wait", START + 1_000 * MS, START + 2_500 * MS, PhaseEnd.TRIGGERED),
        PhaseTime("hold", "hold", START + 2_500 * MS),
    ],
    answers=[Answered("clamped", "Clamped?", "yes", "operator", START + 250 * MS, "M8")],
    safe_state=SafeState.VERIFIED,
    late_mean_ns=MS,
    late_worst_ns=3 * MS,
    age_mean_ns=2 * MS,
    age_worst_ns=5 * MS,
)
EPISODE = Exceedance("T_st", START + 1_200 * MS, START + 1_700 * MS, 0.3, 0.02, 0.26, 0.7, 0.1, 25.0, "wait")


@cache
def job():
    return prepare(files())


def analysed():
    """Return the analysis of a run whose second phase was ended by its motor current, 1.8 s after the begin."""
    dialect = job().setup.dialect
    analysis = Analysis(dialect, job().model, job().limits, "made up")
    zero, wait, hold = RECORD.phases
    analysis.begin_phase(zero.start_ns, zero.id, zero.kind)
    analysis.begin_phase(wait.start_ns, wait.id, wait.kind, Condition(role="motor_current", above="0.5 A"))
    stamps = START + np.array([1_700, 1_800, 1_900]) * MS
    values = {"motor_current": [0.25, 0.75, 1.0], "sample_counter": [0, 2_000, 4_000]}
    analysis.push(MessageWriter(dialect, "EtbCurrent").write(values, stamps))
    analysis.begin_phase(hold.start_ns, hold.id, hold.kind)
    return analysis


def results(verdict="fail", *reasons, episodes=(), analysis=None, **changed):
    """Return the results of the made-up run, whose record is changed."""
    found = DiagnosisResult(
        UnitVerdict(verdict),
        tuple(Reason(id_, "") for id_ in reasons or ("T_st_over",)),
        Measurements(),
        episodes,
        0,
        {},
    )
    session = Session(Path(), "run", "SN 7", "", ())
    parts = (replace(RECORD, **changed), analysis or analysed(), found)
    return results_of(session, job().setup.bench, job().limits, *parts)


def test_times_count_from_the_begin_of_the_run():
    found = results(episodes=(EPISODE,))
    assert found.duration_s == pytest.approx(4.0)
    zero, wait, hold = found.phases
    assert zero == Phase("zero", "current zero", pytest.approx(0.5), pytest.approx(1.0), "done")
    ends = {"trigger_s": pytest.approx(1.8), "trigger_value": pytest.approx(0.75, abs=0.01)}
    assert wait == Phase("wait", "wait", pytest.approx(1.0), pytest.approx(2.5), "triggered", **ends)
    assert hold == Phase("hold", "hold", pytest.approx(2.5), None, "stopped")
    assert found.prompts == (Prompt("clamped", "Clamped?", "yes", "operator", pytest.approx(0.25), "M8"),)
    seen = (pytest.approx(1.2), pytest.approx(1.7), 0.3, 0.26, 0.7, 0.1, 25.0, "wait", 0.02)
    assert found.exceedances == (run_result.Exceedance("T_st", *seen),)


@pytest.mark.parametrize(
    ("start_ms", "phase"),
    [(0, ""), (500, "zero"), (999, "zero"), (1_000, "wait"), (2_499, "wait"), (2_500, "hold"), (3_900, "hold")],
)
def test_an_exceedance_belongs_to_the_phase_in_which_it_begins(start_ms, phase):
    found = results(episodes=(replace(EPISODE, start_ns=START + start_ms * MS, end_ns=START + 3_950 * MS),))
    assert found.exceedances[0].phase == phase


def test_an_unknown_temperature_is_none():
    assert results(episodes=(replace(EPISODE, temperature=nan),)).exceedances[0].temperature is None


def test_what_the_bench_measured_of_itself_is_in_milliseconds():
    bench = results().bench
    assert bench.lateness == Lateness(pytest.approx(1.0), pytest.approx(3.0))
    assert bench.frame_age == FrameAge(pytest.approx(2.0), pytest.approx(5.0))


@pytest.mark.parametrize("state", SafeState)
def test_the_safe_state_is_reached_only_where_it_was_verified(state):
    assert results(safe_state=state).bench.safe_state is (state is SafeState.VERIFIED)


def test_frames_that_nothing_counts_are_no_known_loss():
    analysis = analysed()
    writer = MessageWriter(analysis.dialect, "EtbStatus")
    values = {"mode": 1, "enable": 1, "temperature": 25.0}
    frames = writer.write(values, START + np.arange(2_000, 2_060, 10) * MS)
    analysis.push(frames.select(np.array([0, 1, 2, 5])))
    assert lost_of(analysis) == {"EtbCurrent": (3, 0), "EtbStatus": (4, 2)}
    writer = MessageWriter(analysis.dialect, "EtbStatus")  # whose counter begins anew, as that of a controller does
    analysis.push(writer.write(values, START + np.arange(9_000, 9_020, 10) * MS))
    assert lost_of(analysis) == {"EtbCurrent": (3, 0), "EtbStatus": (6, None)}


def lost_of(analysis):
    messages = results(analysis=analysis).bus.messages
    return {one.name: (one.frames, one.lost) for one in messages if one.frames}


@pytest.mark.parametrize(
    ("verdict", "code"),
    [("pass", ExitCode.DONE), ("fail", ExitCode.UNIT_FAILED), ("inconclusive", ExitCode.INCONCLUSIVE)],
)
def test_a_run_that_ended_well_says_the_verdict_and_what_to_do_with_the_unit(verdict, code):
    found = results(verdict, "uneven_way", "drift")
    assert (found.unit.verdict, found.unit.reason_id, found.unit.also) == (verdict, "uneven_way", ("drift",))
    assert found.exit_code == code
    assert found.unit.next_step
    assert not found.bench.next_step


@pytest.mark.parametrize(("outcome", "code"), [("fault", ExitCode.BENCH_FAULT), ("aborted", ExitCode.ABORTED)])
@pytest.mark.parametrize("verdict", UnitVerdict)
def test_a_run_that_the_bench_ended_judges_no_unit_and_says_what_to_do_with_the_bench(outcome, code, verdict):
    ended = {"outcome": BenchOutcome(outcome), "reason_id": "stopped_by_operator"}
    found = results(verdict, **ended)
    assert (found.unit.verdict, found.unit.reason_id, found.unit.serial) == (None, "run_not_finished", "SN 7")
    assert found.exit_code == code
    assert found.bench.next_step
    assert not found.unit.next_step


def test_an_observer_that_failed_makes_a_bench_fault_of_a_run_that_ended_well_alone():
    analysis = analysed()
    analysis.diagnosis.fault = PartFault("the observer made no sense")
    found = results("pass", analysis=analysis)
    assert (found.bench.outcome, found.bench.reason_id) == ("fault", "part_failed")
    assert found.bench.reason == "the observer made no sense"
    assert (found.unit.verdict, found.exit_code) == (None, ExitCode.BENCH_FAULT)
    stopped = {"outcome": BenchOutcome.ABORTED, "reason_id": "stopped_by_operator", "reason": "key s"}
    found = results("pass", analysis=analysis, **stopped)
    assert (found.bench.outcome, found.bench.reason_id) == ("aborted", "stopped_by_operator")


def test_set_points_are_not_late_while_the_unit_runs_a_routine():
    analysis = analysed()
    period = round(1e9 / job().setup.bench.command_rate)
    paused, ends = 1_000 * MS // period, 1_500 * MS // period
    steps = np.full(2_500 * MS // period, period)
    steps[paused // 2] += 2 * MS  # late before the routine, and after it
    steps[2 * ends - paused] += MS
    stamps = START + np.cumsum(steps)
    is_paused = (stamps > START + 1_000 * MS) & (stamps < START + 1_500 * MS)
    stamps = stamps[~is_paused]
    columns = {"command_mode": np.ones(len(stamps))}
    analysis.recording.append([SampleBlock("EtbCommand", stamps, stamps, columns, np.zeros(len(stamps), np.int64))])
    routines = UnitDiagnostics(routines=(RoutineRun("learn the stops", "before", "done", 1.0, 1.5),))
    found = results(analysis=analysis, diagnostics=routines)
    assert found.unit_diagnostics == routines
    jitter = found.bench.set_point_jitter
    assert jitter.worst_us == pytest.approx(2_000.0)
    assert jitter.rms_us == pytest.approx(np.sqrt((2_000.0**2 + 1_000.0**2) / (len(stamps) - 1)))
    assert results(analysis=analysis).bench.set_point_jitter.worst_us > 400_000.0
