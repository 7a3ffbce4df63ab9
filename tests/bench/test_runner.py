"""What a run tells: its events one by one, its record, and what a watcher sees, from the first beat to drive off."""

import itertools
import json
import os
import signal

import numpy as np
import pytest
from faults_cases import Injected
from faults_study import run_with

from etb_hil.base.errors import BenchFault, InputError, PartFault, RecordingFault
from etb_hil.base.outcome import ExitCode
from etb_hil.base.stock import find
from etb_hil.bench import job as job_room
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.bench.operator import Reply, Unattended
from etb_hil.canio.logs.blf import BlfLog
from etb_hil.scenario.phases import read_phase
from etb_hil.session.events import read_events

MS = 1_000_000
ZERO = "  - {id: zero, kind: current_zero, duration: 0.1 s}\n"
HOLD = "  - {id: hold, kind: hold, position: 30 deg, duration: 0.2 s}\n"
ASK = "  - {id: ready, kind: prompt, text: Clamped, answers: [yes, no], unattended: %s, timeout: 0.3 s}\n"
WAIT = "  - {id: supply, kind: wait, timeout: 0.2 s, until: {role: supply_voltage, above: %s%s}}\n"
FAST = "  - {id: hold, kind: hold, position: 30 deg, duration: 0.2 s, measure: {rate: 2 kHz}}\n"


class Link:
    """A link to the bench; from a time on (ns), `cause` happens at each look."""

    def __init__(self, inner, since_ns, cause):
        self.inner, self.since_ns, self.cause, self.now_ns, self.commands = inner, since_ns, cause, 0, []

    def __getattr__(self, name):
        return getattr(self.inner, name)

    def send(self, frames):
        self.commands.append((self.now_ns, frames))
        self.inner.send(frames)

    def receive(self):
        frames = self.inner.receive()
        self.now_ns = max([self.now_ns, *frames.stamp_ns.tolist()])
        if self.cause is not None and self.now_ns >= self.since_ns:
            self.cause()
        return frames


@pytest.fixture
def run(tmp_path):
    """Run phases on a bus that has been up for a time; keep what a watcher was told in `run.shown`."""

    def run_phases(phases, *, since_ms=0, cause=None, bench="virtual_classic", begins_ms=0, **how):
        path = tmp_path / "scenario.yaml"
        path.write_text(f"schema: etb_hil/scenario/1\nname: test\nphases:\n{phases}")
        job = prepare(JobFiles(path, find("bench", bench), find("model", "default"), find("limits", "default")))
        run_phases.shown, run_phases.links = [], []

        def link(inner, clock):
            if begins_ms:
                clock.sleep_until_ns(begins_ms * MS)
                inner.receive()  # what was sent before is nobody's
            run_phases.links.append(Link(inner, since_ms * MS, cause))
            return run_phases.links[-1], clock

        kept = job_room.connect
        connect = job_room.connect
        try:
            job_room.connect = lambda *given: link(*connect(*given))
            return execute(job, tmp_path, "", 1, run_phases.shown.append, **how)
        finally:
            job_room.connect = kept

    run_phases.folder = tmp_path
    return run_phases


def told(finished):
    """Return the events of a run without their stamps, the first one, `opened`, left out."""
    return [(event.event, event.details) for event in read_events(finished.session.events)][1:]


def test_a_run_tells_all_that_happens(run):
    finished = run(ASK % "yes" + WAIT % ("5 V", "") + ZERO + HOLD)
    record, events = finished.record, told(finished)
    assert [name for name, _ in events] == [
        "start", "phase", "prompt", "answer", "phase_end", "phase", "trigger", "phase_end",
        "phase", "phase_end", "phase", "phase_end", "safe_stop", "safe_state", "end",
    ]  # fmt: skip
    assert events[1:6] == [
        ("phase", {"id": "ready", "kind": "prompt"}),
        ("prompt", {"id": "ready", "text": "Clamped", "answers": ["yes", "no"]}),
        ("answer", {"id": "ready", "text": "Clamped", "answer": "yes", "by": "scenario"}),
        ("phase_end", {"id": "ready", "outcome": "done"}),
        ("phase", {"id": "supply", "kind": "wait"}),
    ]
    assert events[6][1]["id"] == "supply"
    assert events[6][1]["value"] == pytest.approx(13.5, abs=0.3)
    assert "supply_voltage" in events[6][1]["condition"]
    assert events[7] == ("phase_end", {"id": "supply", "outcome": "triggered"})
    assert events[-3:-1] == [("safe_stop", {"cause": "end of the scenario"}), ("safe_state", {"state": "verified"})]
    end = events[-1][1]
    assert (end["outcome"], end["reason_id"], end["reason"], end["is_recorded"]) == ("ok", "", "", True)
    assert end["health"]["sent"] > 50
    assert end["age_worst_ns"] >= end["age_mean_ns"] > 0
    assert (end["late_worst_ns"], end["late_mean_ns"]) == (0, 0)
    stamps = [event.stamp_ns for event in read_events(finished.session.events)][1:]
    assert (stamps[0], stamps[-1]) == (record.start_ns, record.end_ns)
    assert stamps == sorted(stamps)
    assert [(one.answer, one.by, one.id, one.text) for one in record.answers] == [
        ("yes", "scenario", "ready", "Clamped")
    ]
    assert [phase.id for phase in record.phases] == ["ready", "supply", "zero", "hold"]
    for phase, later in itertools.pairwise(record.phases):
        assert phase.start_ns < phase.end_ns <= later.start_ns
    assert record.phases[2].end_ns - record.phases[2].start_ns == pytest.approx(100 * MS, abs=10 * MS)


def test_a_watcher_sees_the_run_go_on(run):
    run(ASK % "yes" + ZERO + "  - {id: hold, kind: hold, position: 30 deg, duration: 1 s}\n", begins_ms=3000)
    shown = run.shown
    held = [one for one in shown if one.phase == "hold"]
    assert held[-1].set_point == pytest.approx(np.radians(30.0))
    assert held[-1].angle == pytest.approx(np.radians(30.0), abs=0.03)
    assert abs(held[-1].velocity) < 0.5
    assert held[-1].current > 0.05
    assert held[-1].temperature == pytest.approx(25.0, abs=15.0)
    assert 0.05 < held[-1].bus_load < 1.0
    assert (held[-1].frames_lost, held[-1].exceedances, held[-1].error_frames) == (0, 0, 0)
    assert held[-1].bus_state == "error-active"
    assert held[-1].late_ms == 0.0
    assert 0.0 < held[-1].frame_age_ms < 10.0
    assert shown[0].set_point is None
    assert shown[0].message == ""
    assert 0.0 < shown[0].time_s < 0.03
    assert [one.time_s for one in shown] == sorted(one.time_s for one in shown)
    left = [one.total_s - one.time_s for one in shown]
    assert 1.0 < left[0] < 1.6  # the hold with its way there, and the current's zero; no answer's
    assert left[-1] < 0.2
    assert held[0].total_s - held[0].time_s > 1.0  # the phase that has begun counts, too
    assert all(a >= b for a, b in itertools.pairwise(left))


class Slow(Unattended):
    """Somebody who answers with the tenth look."""

    name = "somebody"

    def __init__(self, answer, looks=10):
        super().__init__()
        self.said, self.looks, self.asked, self.withdrawn = answer, looks, [], 0

    def ask(self, prompt):
        self.asked.append(prompt.text)

    def answer(self):
        self.looks -= 1
        return Reply(self.said) if self.looks < 0 else None

    def withdraw(self):
        self.withdrawn += 1


def test_while_an_operator_is_asked_the_drive_is_off_and_the_prompt_is_shown(run):
    somebody = Slow("yes", looks=20)
    finished = run(HOLD + ASK % "yes" + ZERO, operator=somebody)
    assert (finished.results.bench.outcome, somebody.asked, somebody.withdrawn) == ("ok", ["Clamped"], 1)
    asked = [one for one in run.shown if one.message]
    assert {one.message for one in asked} == {"Clamped"}
    assert all(one.set_point is None for one in asked)
    assert run.shown[-1].message == ""
    (_, prompt, _) = finished.record.phases
    assert prompt.end_ns - prompt.start_ns == pytest.approx(210 * MS, abs=11 * MS)
    (answer,) = finished.record.answers
    assert answer.by == "somebody"
    assert answer.stamp_ns == pytest.approx(prompt.start_ns + 200 * MS, abs=11 * MS)
    mode = finished.analysis.recording.series("command_mode")
    inside = (mode.time_ns > prompt.start_ns) & (mode.time_ns < prompt.end_ns)
    assert mode.values[inside].max() == 0.0


@pytest.mark.parametrize(
    ("answer", "looks", "reason_id", "reason"),
    [
        ("no", 2, "stopped_by_answer", "Clamped - no"),
        ("yes", 99, "nobody_answered", "nobody answered: Clamped"),
        ("yes", 29, "", ""),
    ],
)
def test_an_answer_decides_how_a_run_goes_on(run, answer, looks, reason_id, reason):
    finished = run(ASK % "yes" + ZERO, operator=Slow(answer, looks))
    bench = finished.results.bench
    assert (bench.outcome, bench.reason_id, bench.reason) == ("aborted" if reason else "ok", reason_id, reason)
    assert bench.safe_state
    assert [entry.answer for entry in finished.record.answers] == ([answer] if looks < 30 else [])


@pytest.mark.parametrize(("more", "stops"), [("", True), (", otherwise: go_on", False), (", otherwise: stop", True)])
def test_a_condition_that_never_comes_true_stops_the_run_or_not(run, more, stops):
    finished = run(WAIT % ("50 V", more) + ZERO)
    bench = finished.results.bench
    assert bench.reason_id == ("condition_never_true" if stops else "")
    assert bench.outcome == ("fault" if stops else "ok")
    assert finished.record.phases[0].end == "condition never true"
    assert len(finished.record.phases) == (1 if stops else 2)
    if stops:
        assert bench.reason.startswith("phase 'supply': ")
        assert finished.record.phases[0].end_ns is not None


def test_a_phase_may_ask_for_samples_of_its_own(run):
    finished = run(ZERO + FAST + "  - {id: off, kind: off, duration: 0.2 s}\n")
    current = finished.analysis.recording.series("motor_current")
    zero, fast, off = finished.record.phases

    def rate(phase):
        late = phase.start_ns + 50 * MS, phase.end_ns - 5 * MS
        return np.count_nonzero((current.time_ns > late[0]) & (current.time_ns < late[1])) / (late[1] - late[0]) * 1e9

    assert rate(zero) == pytest.approx(1000.0, rel=0.1)
    assert rate(fast) == pytest.approx(2000.0, rel=0.1)
    assert rate(off) == pytest.approx(1000.0, rel=0.1)


def test_a_motion_begins_where_the_plate_was_sent_or_where_it_is(run):
    finished = run(
        "  - {id: up, kind: hold, position: 60 deg, duration: 0.1 s}\n"
        "  - {id: off, kind: off, duration: 0.4 s}\n"
        "  - {id: on, kind: hold, position: 20 deg, duration: 0.1 s}\n"
        "  - {id: on2, kind: hold, position: 30 deg, duration: 0.1 s}\n"
    )
    position = finished.analysis.recording.series("command_position")
    angle = finished.analysis.recording.series("throttle_angle")
    limp_home = finished.analysis.model.values.limp_home
    first = [position.values[np.searchsorted(position.time_ns, phase.start_ns)] for phase in finished.record.phases]
    assert first[0] == pytest.approx(limp_home, abs=0.02)
    where = angle.values[np.searchsorted(angle.time_ns, finished.record.phases[2].start_ns) - 1]
    assert first[2] == pytest.approx(where, abs=0.02)
    assert abs(where - np.radians(60.0)) > 0.2  # the springs led it back
    assert first[3] == pytest.approx(np.radians(20.0), abs=0.02)


def test_set_points_follow_the_motion_of_a_phase(run):
    ramp = {"id": "r", "kind": "ramp", "between": ["20 deg", "60 deg"], "speed": "2 rad/s", "approach": "1 rad/s"}
    finished = run(f"  - {json.dumps(ramp)}\n")
    position = finished.analysis.recording.series("command_position")
    (phase,) = finished.record.phases
    first, last = np.searchsorted(position.time_ns, [phase.start_ns, phase.end_ns])
    since = (position.time_ns[first:last] - position.time_ns[first]) * 1e-9
    motion = read_phase(ramp).trajectory(position.values[first], finished.analysis.model.values)
    assert since[-1] == pytest.approx(motion.duration, abs=0.02)
    expected = [motion.at(one).position for one in since]
    assert position.values[first:last] == pytest.approx(expected, abs=0.01)  # of half an interval of 10 ms at 2 rad/s
    assert np.diff(since) == pytest.approx(0.01, abs=0.002)


def test_a_stop_in_order_leads_the_plate_home_where_the_drive_is_on(run):
    def stop():
        os.kill(os.getpid(), signal.SIGUSR1)

    finished = run(
        "  - {id: up, kind: hold, position: 60 deg, duration: 0.2 s}\n" + ZERO, since_ms=600, cause=stop
    )  # fmt: skip
    bench = finished.results.bench
    assert (bench.outcome, bench.reason_id, bench.reason) == ("aborted", "stopped_by_operator", "key s or r")
    position = finished.analysis.recording.series("command_position")
    mode = finished.analysis.recording.series("command_mode")
    on = position.values[mode.values == 1.0]
    limp_home = finished.analysis.model.values.limp_home
    assert on[-1] == pytest.approx(limp_home, abs=0.02)
    assert finished.record.end_ns - finished.record.start_ns < 2_000 * MS
    back = (on > limp_home + 0.1) & (on < on.max() - 0.1)
    back[: on.argmax()] = False
    time_s = position.time_ns[mode.values == 1.0][back] * 1e-9
    assert np.polyfit(time_s, on[back], 1)[0] == pytest.approx(-1.0, abs=0.01)  # rad/s, as the controller's own


def test_a_stop_in_order_is_at_once_where_the_drive_is_off(run):
    finished = run("  - {id: off, kind: off, duration: 5 s}\n", since_ms=300, cause=lambda: os.kill(os.getpid(), 10))
    assert finished.results.bench.reason_id == "stopped_by_operator"
    assert finished.record.end_ns - finished.record.start_ns < 600 * MS


@pytest.mark.parametrize(("cause", "reason_id"), [("", "not_recorded"), ("the bus is gone", "bus_fault")])
def test_frames_that_are_lost_in_the_end_are_told_and_hide_no_other_fault(run, monkeypatch, cause, reason_id):
    flush, failed, begun = BlfLog.flush, [], []

    def full(log):
        if failed or not begun:
            return flush(log)
        failed.append(1)
        raise RecordingFault("raw.blf: the raw log cannot be written: No space left on device")

    def gone():
        begun.append(1)  # not before: how often a log is flushed is a matter of the wall clock
        if cause:
            raise BenchFault(cause)

    monkeypatch.setattr(BlfLog, "flush", full)
    finished = run("  - {id: off, kind: off, duration: 0.2 s}\n", since_ms=100, cause=gone)
    bench = finished.results.bench
    assert (bench.outcome, bench.reason_id) == ("fault", reason_id)
    assert bench.reason == (cause or "raw.blf: the raw log cannot be written: No space left on device")
    assert finished.record.is_recorded is False
    assert told(finished)[-1][1]["is_recorded"] is False


@pytest.mark.parametrize("failed", [InputError, PartFault])
def test_a_part_that_fails_amid_a_run_is_a_fault_of_the_bench(run, failed):
    def fails():
        raise failed("mine.py: the plug-in's phase 'mine': its trajectory failed")

    finished = run(HOLD, since_ms=200, cause=fails)
    bench = finished.results.bench
    assert (bench.outcome, bench.reason_id) == ("fault", "part_failed")
    assert bench.reason == "mine.py: the plug-in's phase 'mine': its trajectory failed"
    assert (finished.results.code, finished.results.unit.verdict) == (ExitCode.BENCH_FAULT, None)


def test_a_bus_that_fails_is_a_fault_of_the_bench(run):
    def gone():
        raise BenchFault("the bus is gone")

    finished = run(HOLD, since_ms=200, cause=gone)
    bench = finished.results.bench
    assert (bench.outcome, bench.reason_id, bench.reason) == ("fault", "bus_fault", "the bus is gone")
    assert not bench.safe_state
    events = told(finished)
    assert events[-3:-1] == [("safe_stop", {"cause": "bus_fault"}), ("safe_state", {"state": "not verified"})]


def test_an_error_of_our_own_is_told_to_the_caller_after_drive_off(run):
    struck = []

    def bug():
        if not struck:
            struck.append(1)
            raise ZeroDivisionError("a bug")

    with pytest.raises(ZeroDivisionError, match="a bug"):
        run(HOLD, since_ms=200, cause=bug)
    (path,) = run.folder.glob("*/events.jsonl")
    events = [(event.event, event.details) for event in read_events(path)]
    assert events[-2:] == [("safe_stop", {"cause": "bench_failed"}), ("safe_state", {"state": "verified"})]


@pytest.mark.spoilt
def test_a_host_that_was_late_says_so_in_the_record(run):
    stalled = []

    def stall():
        if not stalled:
            stalled.append(1)
            inner = run.links[0].inner
            inner._network.sleep_until_ns(inner._network.now_ns() + 25 * MS)

    record = run(ZERO + "  - {id: off, kind: off, duration: 0.3 s}\n", since_ms=100, cause=stall).record
    assert record.late_worst_ns == 15 * MS
    assert run.shown[-1].late_ms == pytest.approx(15.0)
    assert 0 < record.late_mean_ns < MS
    assert record.age_worst_ns > record.age_mean_ns > 0


@pytest.mark.spoilt
def test_a_controller_that_sleeps_is_asked_every_twentieth_of_a_second(run):
    class Deaf(Link):
        def receive(self):
            return super().receive().select(slice(0))

    asked = []

    class Counting(Deaf):
        def send(self, frames):
            asked.extend(frames.ident.tolist())
            super().send(frames)

    job = prepare(JobFiles(find("scenario", "paper_step"), find("bench", "virtual_classic"), find("model", "default"),
                           find("limits", "default")))  # fmt: skip
    finished = run_with(job, run.folder, 1, [Injected(link=[lambda inner: Counting(inner, 0, None)])])
    bench = finished.results.bench
    assert (bench.outcome, bench.reason_id) == ("fault", "no_answer")
    assert "within 1 s of the request" in bench.reason
    requests = asked.count(min(asked, key=asked.count))
    assert requests == 21  # at once, then every 50 ms until a second has passed
