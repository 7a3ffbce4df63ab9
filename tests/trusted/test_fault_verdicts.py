"""Faults of bus, controller, sensors and clocks: the right verdict, inconclusive or bench fault, never a wrong one.

A seed or two of each here, the healthy unit's among the studies; `benchmarks/faults_study.py` runs as many as wanted,
and pairs.
"""

import numpy as np
import pytest
from faults_cases import CASES, Injected
from faults_nodes import MS, Late, Rewriting, SetBackStamps
from faults_study import EXPECTED, job_of, judge, run_with, seed_of
from whole_run import BRISK

from etb_hil.canio.bus.faults import Forged, Lost, StuckCounter, Window, protections_of
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.replays.session_replay import replay
from etb_hil.session.differences import first_difference

pytestmark = pytest.mark.spoilt

S = 1_000 * MS


@pytest.fixture(scope="module")
def brisk(tmp_path_factory):
    """Return a scenario with what a verdict needs and no more."""
    path = tmp_path_factory.mktemp("scenario") / "brisk.yaml"
    path.write_text(BRISK, "utf-8")
    return str(path)


@pytest.fixture(scope="module")
def brisk_jobs(brisk):
    return {unit: job_of("virtual_classic", unit, brisk) for unit in EXPECTED}


@pytest.fixture(scope="module")
def jobs():
    return {unit: job_of("virtual_classic", unit) for unit in EXPECTED}


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("unit", ["faulty", pytest.param("default", marks=pytest.mark.study)])
def test_no_fault_makes_a_wrong_verdict(jobs, name, unit):
    kind, said = judge(jobs[unit], unit, seed_of(name, "test", unit), (name,))
    assert kind in {"right", "unsure", "fault"}, said


@pytest.mark.parametrize(
    ("role", "change", "reason"),
    [
        ("motor_current", lambda v: np.full_like(v, 0.5), "current_frozen"),
        ("throttle_angle_2", lambda v: v - 0.1, "tracks_disagree"),
        ("motor_angle", lambda v: v + 3.0, "angles_disagree"),
        ("motor_current", lambda v: v + 1.0, "motor_balance"),
        ("sample_counter", lambda v: v + 1000.0, "clocks_disagree"),
    ],
)
def test_a_sensor_that_cannot_be_true_is_named(tmp_path, brisk_jobs, role, change, reason):
    dialect = brisk_jobs["default"].setup.dialect

    def changed(name, values, _stamp_ns):
        return change(values) if name == role else None

    spoil = Injected(spoil=[lambda node: Rewriting(node, dialect, 7 * S, 9 * S, changed)])
    unit = run_with(brisk_jobs["default"], tmp_path, 1, [spoil]).results.unit
    assert unit.verdict == "inconclusive"
    assert reason in (unit.reason_id, *unit.also)


@pytest.mark.parametrize(("step_us", "every_ms"), [pytest.param(400, 50, marks=pytest.mark.study), (2000, 7)])
def test_a_hosts_clock_that_is_set_back_again_and_again_changes_nothing(tmp_path, brisk, step_us, every_ms):
    shaken = Injected(link=[lambda link: SetBackStamps(link, step_us * 1000, every_ms * MS)])
    finished = run_with(job_of("virtual_fd", "faulty", brisk), tmp_path, 5, [shaken])
    assert finished.results.unit.verdict == "fail"
    assert not any(message.lost for message in finished.results.bus.messages)
    assert first_difference(replay(finished.session.folder)) is None


@pytest.mark.parametrize("delay_ms", [pytest.param(60, marks=pytest.mark.study), 95, 105, 250])
def test_a_constant_delay_is_measured_and_too_long_a_one_ends_the_run(tmp_path, brisk_jobs, delay_ms):
    delayed = Injected(spoil=[lambda node: Late(node, 0, delay_ms * MS)])
    results = run_with(brisk_jobs["default"], tmp_path, 1, [delayed]).results
    if delay_ms < 100:  # the bench's `frame_age`
        assert results.unit.verdict == "pass"
        assert delay_ms < results.bench.answer_time.mean_ms < delay_ms + 11
    else:
        assert results.bench.reason_id == "answers_late"
        assert results.duration_s < 2.0
        assert results.bench.safe_state is True


@pytest.mark.parametrize(
    ("start_ms", "length_ms"),
    [(6000, 3), (7003, 40), *(pytest.param(*one, marks=pytest.mark.study) for one in ((6000, 15), (9500, 90)))],
)
def test_lost_frames_are_counted_exactly(tmp_path, brisk_jobs, start_ms, length_ms):
    dialect = brisk_jobs["default"].setup.dialect
    idents = {m.ident: m.name for m in dialect.messages if not m.commanded}
    gone = dict.fromkeys(idents.values(), 0)

    class Counting(Lost):
        __slots__ = ()

        def deliver(self, frame, start_ns):
            left = super().deliver(frame, start_ns)
            gone[idents.get(int(frame.ident[0]), "")] = gone.get(idents.get(int(frame.ident[0]), ""), 0) + 1 - len(left)
            return left

    window = Window(start_ms * MS, (start_ms + length_ms) * MS, frozenset(idents))
    finished = run_with(brisk_jobs["default"], tmp_path, 1, [Injected(bus=[Counting(window)])])
    counted = {m.name: m.lost for m in finished.results.bus.messages if m.name in gone}
    assert counted == {name: gone[name] for name in counted}
    assert sum(gone.values()) > 2


def test_faults_cost_nothing_outside_their_windows(jobs):
    bus, dialect = jobs["default"].setup.bench.bus, jobs["default"].setup.dialect
    network = VirtualNetwork(int(bus.bitrate))
    protections = protections_of(dialect)
    network.faults = [
        StuckCounter(Window(S, 2 * S), protections),
        Forged(Window(S, 2 * S), protections),
    ]
    assert list(network._injection.due(network.faults, S)) == []
    assert len(network._injection.due(network.faults, S + 1)) == 2
    assert len(network._injection.due(network.faults, 3 * S)) == 2  # from before that until 3 s
    assert list(network._injection.due(network.faults, 4 * S)) == []
