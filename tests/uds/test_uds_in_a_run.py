"""A run on a bench with UDS: identity, codes before and after, routines; and what ends it as a bench fault."""

import json
import math
import re
import signal
from dataclasses import replace

import numpy as np
import pytest
import yaml
from uds_bench import UDS, faulty_run, frames_of
from whole_run import files

from etb_hil.base.outcome import BenchOutcome, ExitCode, UnitVerdict
from etb_hil.base.stock import find
from etb_hil.bench import job as job_room
from etb_hil.bench.expected_unit import ExpectedUnit
from etb_hil.bench.job import execute, prepare
from etb_hil.canio.bus.link import VirtualLink
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.controller.uds.faults import UdsFault, UdsFaultKind
from etb_hil.replays.session_replay import replay
from etb_hil.report.html_report import render_page
from etb_hil.report.junit import Reported, junit_text
from etb_hil.report.verdict import verdict_text
from etb_hil.results.json_file import result_from_dict

SHORT = """
schema: etb_hil/scenario/1
name: Short
phases:
  - {id: current_zero, kind: current_zero, duration: 0.6 s}
  - {id: ramp, kind: ramp, between: [10 deg, 20 deg], speed: 1 rad/s}
  - {id: return, kind: off, duration: 0.6 s}
"""
PLOTS = dict.fromkeys(("friction_over_speed", "friction_over_angle", "time_traces"), "<svg/>")


@pytest.fixture
def short(tmp_path):
    path = tmp_path / "short.yaml"
    path.write_text(SHORT, "utf-8")
    return path


@pytest.fixture(scope="module")
def faulty(tmp_path_factory):
    chosen = replace(files(bench="virtual_uds", unit="faulty"), expected=ExpectedUnit(part_number="default-throttle"))
    return execute(prepare(chosen), tmp_path_factory.mktemp("sessions"), "ETB-0042", 3)


def run(short, tmp_path, monkeypatch=None, *, faults=(), expected=None, node=None, **options):
    chosen = replace(files(scenario=short, bench="virtual_uds"), expected=expected)
    if monkeypatch is not None:
        return faulty_run(monkeypatch, chosen, tmp_path, faults, node=node, **options)
    return execute(prepare(chosen), tmp_path / "sessions", "ETB-0042", 3)


def test_the_unit_reports_its_code_beside_the_measurement(faulty):
    results = faulty.results
    assert (results.bench.outcome, results.unit.verdict) == (BenchOutcome.OK, UnitVerdict.FAIL)
    found = results.unit_diagnostics
    assert [one.value for one in found.identity[:2]] == ["ETB-0042", "default-throttle"]
    assert found.codes_before == ()
    assert [code.code for code in found.codes_after] == ["P2119"]
    assert [(one.name, one.when, one.outcome) for one in found.routines] == [("learn_stops", "before", "done")]
    text = " ".join(verdict_text(results).split())
    assert re.search(r"The unit reports P2119; measured: break-away friction 0\.56\d N·m", text)  # 0.567 in truth
    assert "spring torque above limp-home 0.3" in text


def test_what_is_within_its_limits_is_as_it_should_be(tmp_path):
    chosen = files(bench="virtual_uds", unit="faulty", limits="end_of_line")
    text = " ".join(verdict_text(execute(prepare(chosen), tmp_path, "ETB-0042", 3).results).split())
    assert re.search(r"The unit reports P2119; measured: break-away friction 0\.56\d N·m \(allowed at most", text)
    assert re.search(r"spring torque above limp-home 0\.3[45]\d N·m as it should be", text)  # 0.350 in truth


def test_report_and_junit_show_it(faulty):
    page = render_page(faulty.results, PLOTS, {})
    assert "own diagnostics report" in page
    assert "P2119" in page
    document = junit_text([Reported(faulty.results)])
    assert '<property name="unit.codes_after" value="P2119"' in document
    assert '<property name="unit.serial" value="ETB-0042"' in document


def test_a_replay_and_the_file_give_the_same(faulty):
    assert replay(faulty.session.folder).results.unit_diagnostics == faulty.results.unit_diagnostics
    kept = json.loads((faulty.session.folder / "results.json").read_text("utf-8"))
    assert result_from_dict(kept) == faulty.results


def test_another_unit_than_the_station_expects_does_not_move(short, tmp_path):
    results = run(short, tmp_path, expected=ExpectedUnit(part_number="other-part", software="9.9")).results
    assert (results.bench.outcome, results.bench.reason_id) == (BenchOutcome.FAULT, "wrong_unit")
    assert results.phases == ()
    assert results.unit.verdict is None
    assert "part number 'default-throttle', not 'other-part'" in results.bench.reason
    assert ", not '9.9'" in results.bench.reason
    assert results.bench.safe_state


def test_codes_are_cleared_where_the_station_says_so(short, tmp_path):
    results = run(short, tmp_path, expected=ExpectedUnit(clears_codes=True)).results
    assert results.unit_diagnostics.cleared
    assert results.unit_diagnostics.codes_left == ()
    assert results.bench.outcome is BenchOutcome.OK


def test_a_code_that_cannot_be_cleared_is_said(short, tmp_path, monkeypatch):
    chosen = ExpectedUnit(clears_codes=True)
    identity = {"serial": "ETB-0042"}
    finished = run(short, tmp_path, monkeypatch, expected=chosen, track_2_offset=0.05, identity=identity)
    results = finished.results
    assert [code.code for code in results.unit_diagnostics.codes_left] == ["P2135"]
    text = " ".join(verdict_text(results).split())
    assert "After its trouble codes were cleared, the unit reported P2135 again" in text
    assert "back at once: P2135" in render_page(results, PLOTS, {})
    assert '"unit.codes_left" value="P2135"' in junit_text([Reported(results)])
    assert replay(finished.session.folder).results.unit_diagnostics == results.unit_diagnostics


@pytest.mark.spoilt
def test_a_controller_that_sleeps_is_a_bench_fault_within_two_seconds(short, tmp_path, monkeypatch):
    for name in ("virtual_uds", "virtual_uds_data"):
        chosen = files(scenario=short, bench=name)
        network = VirtualNetwork(1_000_000)
        monkeypatch.setattr(job_room, "connect", lambda *_, on=network: (VirtualLink(on), on.clock))
        results = execute(prepare(chosen), tmp_path / "sessions", "ETB-0042", 3).results
        assert (results.bench.outcome, results.bench.reason_id) == (BenchOutcome.FAULT, "no_answer")
        assert results.unit.verdict is None
        assert results.duration_s < 2.0


def test_the_stops_are_learnt_before_and_after(short, tmp_path, monkeypatch):
    connect = job_room.connect

    def connected_late(*given):
        link, clock = connect(*given)
        clock.sleep_until_ns(2_000_000_000)  # times of routines count from the run's begin, not from the bus's
        link.receive()
        return link, clock

    monkeypatch.setattr(job_room, "connect", connected_late)
    plain = yaml.safe_load(find("bench", "virtual_uds").read_text("utf-8"))
    plain["uds"]["routines"]["learn_stops"]["after"] = True
    path = tmp_path / "bench.yaml"
    path.write_text(yaml.safe_dump(plain), "utf-8")
    finished = execute(prepare(replace(files(scenario=short), bench=path)), tmp_path / "sessions", "", 3)
    results = finished.results
    assert (results.bench.outcome, results.bench.safe_state) == (BenchOutcome.OK, True)
    before, after = results.unit_diagnostics.routines
    assert [(one.when, one.outcome) for one in (before, after)] == [("before", "done"), ("after", "done")]
    assert before.end_s <= results.phases[0].start_s
    assert after.start_s >= results.phases[-1].end_s
    angle = finished.analysis.recording.series("throttle_angle")
    time_s = (angle.time_ns - finished.record.start_ns) * 1e-9
    for routine in (before, after):  # the plate was at both stops, and let go at limp-home
        inside = angle.values[(time_s > routine.start_s) & (time_s < routine.end_s)]
        assert inside.min() < math.radians(1.0)
        assert inside.max() > math.radians(80.0)
    assert "Learn stops, after the scenario" in render_page(results, PLOTS, {})


def test_a_routine_that_does_not_end_after_the_run_is_said(short, tmp_path):
    plain = yaml.safe_load(find("bench", "virtual_uds").read_text("utf-8"))
    plain["uds"]["routines"]["learn_stops"] |= {"before": False, "after": True, "longest": "1 s"}
    path = tmp_path / "bench.yaml"
    path.write_text(yaml.safe_dump(plain), "utf-8")
    chosen = replace(files(scenario=short), bench=path)
    results = execute(prepare(chosen), tmp_path / "sessions", "", 3).results
    assert (results.bench.outcome, results.bench.reason_id) == (BenchOutcome.FAULT, "uds_routine")
    assert [one.outcome for one in results.unit_diagnostics.routines] == ["not ended"]
    assert results.unit.verdict is None
    assert results.bench.safe_state


@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        (UdsFaultKind.NO_ANSWER, "uds_no_answer"),
        (UdsFaultKind.PENDING_FOR_EVER, "uds_no_answer"),
        (UdsFaultKind.SLOW, None),
        (UdsFaultKind.WRONG_LENGTH, "uds_bad_answer"),
        (UdsFaultKind.WRONG_SEQUENCE, "uds_bad_answer"),
        (UdsFaultKind.WRONG_SERVICE, "uds_bad_answer"),
        (UdsFaultKind.SECOND_TESTER, "uds_second_tester"),
    ],
)
def test_faults_of_the_unit_are_bench_faults_in_bounded_time(kind, reason, short, tmp_path, monkeypatch):
    faults = (UdsFault(kind, 0x22 if kind is not UdsFaultKind.SLOW else 0x19),)
    results = run(short, tmp_path, monkeypatch, faults=faults).results
    if reason is None:
        assert results.bench.outcome is BenchOutcome.OK
        return
    assert (results.bench.outcome, results.bench.reason_id) == (BenchOutcome.FAULT, reason)
    assert results.unit.verdict is None
    assert results.phases == ()
    assert results.duration_s < UDS.timing.longest + 1.5


def test_the_codes_are_read_after_a_run_that_the_controller_ended(short, tmp_path, monkeypatch):
    def change(role, values, stamp_ns):
        return np.where(stamp_ns[:, None] > 5_000_000_000, 4.0, values) if role == "faults" else None

    results = run(short, tmp_path, monkeypatch, change=change).results
    assert (results.bench.outcome, results.bench.reason_id) == (BenchOutcome.FAULT, "controller_fault")
    assert results.unit_diagnostics.codes_after is not None
    assert results.unit.verdict is None


def test_a_fault_after_the_run_gives_no_verdict(short, tmp_path, monkeypatch):
    faults = (UdsFault(UdsFaultKind.NO_ANSWER, 0x19, after_ns=5_000_000_000),)  # codes were read by then, once
    results = run(short, tmp_path, monkeypatch, faults=faults).results
    assert len(results.phases) == 3
    assert (results.bench.outcome, results.bench.reason_id) == (BenchOutcome.FAULT, "uds_no_answer")
    assert results.unit.verdict is None
    assert results.bench.safe_state


class Operator:
    """Gives this process a signal when the bench asks for trouble codes the second time."""

    def __init__(self, number):
        self._number, self._asked = number, 0

    def run(self, _until_ns, inbox):
        asks = (inbox.ident == UDS.request) & (inbox.data[:, 1] == 0x19) & (inbox.data[:, 0] < 8)
        before, self._asked = self._asked, self._asked + int(np.count_nonzero(asks))
        if before < 2 <= self._asked:
            signal.raise_signal(self._number)
        return frames_of(UDS.request, [])


@pytest.mark.parametrize(
    ("number", "reason_id"),
    [
        (signal.SIGUSR1, "stopped_by_operator"),
        pytest.param(signal.SIGTERM, "aborted_by_operator", marks=pytest.mark.study),
    ],
)
def test_who_ends_the_run_while_codes_are_read_after_it_is_no_fault_of_the_bench(
    short, tmp_path, monkeypatch, number, reason_id
):
    faults = (UdsFault(UdsFaultKind.NO_ANSWER, 0x19, after_ns=5_000_000_000),)
    finished = run(short, tmp_path, monkeypatch, faults=faults, node=Operator(number))
    results = finished.results
    assert (results.bench.outcome, results.bench.reason_id) == (BenchOutcome.ABORTED, reason_id)
    assert (results.code, results.unit.verdict) == (ExitCode.ABORTED, None)
    assert results.bench.safe_state
    assert replay(finished.session.folder).results == results


class SecondTester:
    """Asks the unit as well, every 20 ms."""

    def __init__(self, from_s):
        self._next = round(from_s * 1e9)

    def run(self, until_ns, _inbox):
        due = []
        while self._next < until_ns:
            due.append(self._next)
            self._next += 20_000_000
        frames = frames_of(UDS.request, [bytes.fromhex("023e80")] * len(due))
        frames.stamp_ns[:] = due
        return frames


@pytest.mark.parametrize("from_s", [0.0, 5.0])  # before anything moves, and amid the scenario
def test_a_second_tester_is_named(short, tmp_path, monkeypatch, from_s):
    results = run(short, tmp_path, monkeypatch, node=SecondTester(from_s)).results
    assert results.duration_s < from_s + 1.5
    assert [phase.id for phase in results.phases if phase.start_s > from_s] == []  # the scenario was not gone on with
    assert (results.bench.outcome, results.bench.reason_id) == (BenchOutcome.FAULT, "uds_second_tester")
    assert results.unit.verdict is None
