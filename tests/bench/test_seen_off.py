"""When the drive counts as off: the measured current and the reported bridge decide, in samples after the command."""

import os
import resource
import signal
import time

import numpy as np
import pytest
from faults_cases import Injected
from faults_nodes import Rewriting
from faults_study import run_with

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, prepare
from etb_hil.canio.frames import concatenate_frames
from etb_hil.controller.virtual_controller import VirtualController
from etb_hil.replays.session_replay import replay
from etb_hil.session.differences import first_difference

ZERO = "  - {id: zero, kind: current_zero, duration: 0.3 s}\n"
HOLD = "  - {id: hold, kind: hold, position: 30 deg, duration: 0.2 s}\n"
OFF = "  - {id: off, kind: off, duration: 0.5 s}\n"
MS = 1_000_000


class Link:
    """A link to a virtual bench; a test says what else happens when the bench sends or receives."""

    def __init__(self, link, drive):
        self.link, self.drive, self.now_ns = link, drive, 0

    def __getattr__(self, name):
        return getattr(self.link, name)

    def receive(self):
        frames = self.link.receive()
        self.now_ns = max([self.now_ns, *frames.stamp_ns.tolist()])
        return frames


class AfterOff:
    """A controller whose signals are what a test says from the moment at which it switched its bridge off."""

    def __init__(self, job, said, zero):
        self.job, self.said, self.zero = job, said, zero
        self.switches = []

    @property
    def is_off(self):
        """Whether the bridge was on and is off again."""
        return bool(self.switches) and not self.switches[-1].on

    def make(self, _make, dialect):
        """Return the controller as a node."""
        uds = self.job.setup.bench.uds
        node = VirtualController(
            self.job.unit, dialect, 1, nominal=self.job.model, on_switch=self.switches.append, uds=uds
        )
        return Rewriting(node, dialect, 0, 1 << 62, self.change)

    def change(self, role, values, stamp_ns):
        """Return the values of a role that are sent; the current is always off by the sensor's zero."""
        if role == "motor_current":
            values = values + self.zero
        if role not in self.said or not self.is_off:
            return values
        since_ns = stamp_ns - self.switches[-1].stamp_ns
        said = np.array([[self.said[role](since)] for since in since_ns.tolist()])
        return np.where(since_ns[:, None] > 0, said, values)


@pytest.fixture
def run(tmp_path):
    """Run a short scenario; `said` says what a role is, of the ns since the bridge went off.

    `link` and `node` take the bench's link, and the controller, and stand in their place.
    """

    def run_scenario(
        phases=ZERO + HOLD, said=None, link=None, zero=0.0, head="", stock="virtual_classic", bench=lambda text: text,
        node=lambda controller, _drive: controller,
    ):  # fmt: skip
        scenario, bench_file = tmp_path / "scenario.yaml", tmp_path / "bench.yaml"
        scenario.write_text(f"schema: etb_hil/scenario/1\nname: test\n{head}phases:\n{phases}")
        bench_file.write_text(bench(find("bench", stock).read_text()))
        job = prepare(JobFiles(scenario, bench_file, find("model", "default"), find("limits", "default"), None))
        run_scenario.drive = drive = AfterOff(job, said or {}, zero)
        spoilt = Injected(
            make=lambda *controller: node(drive.make(*controller), drive),
            link=[] if link is None else [lambda inner: link(inner, drive)],
        )
        finished = run_with(job, tmp_path / "out", 1, [spoilt])
        again = replay(finished.session.folder)
        assert first_difference(again) is None or not again.record.is_recorded
        return finished.results

    return run_scenario


def constant(value):
    return lambda since_ns: value  # noqa: ARG005 (one signature for all)


def is_seen_off(results):
    """Return whether the drive was seen to be off; where it was not, nothing may be said of the unit."""
    bench = results.bench
    if bench.safe_state:
        assert (bench.outcome, bench.reason_id) == ("ok", "")
    else:
        assert (bench.outcome, bench.reason_id) == ("fault", "safe_state_not_verified")
        assert bench.reason == "drive off was commanded, but could not be verified from the measured current"
        assert (results.unit.verdict, results.exit_code) == (None, 3)
    return bench.safe_state


@pytest.mark.parametrize(
    ("current", "is_off"), [(0.04, True), (-0.04, True), (0.06, False), (-0.06, False), (-1.0, False)]
)
def test_a_current_of_more_than_fifty_milliamperes_is_not_off(run, current, is_off):
    assert is_seen_off(run(said={"motor_current": constant(current)})) is is_off


def test_a_bridge_that_is_reported_on_is_not_off(run):
    assert not is_seen_off(run(said={"enable": constant(1.0)}))


def test_where_the_bridge_is_not_reported_the_current_decides(run):
    def without(text):
        return text.replace("  enable: EtbStatus.BridgeOn\n", "")

    assert is_seen_off(run(bench=without))
    assert not is_seen_off(run(bench=without, said={"motor_current": constant(1.0)}))


@pytest.mark.parametrize(("until_ms", "is_off"), [(400, True), (600, False)])
def test_half_a_second_is_enough_for_the_current_to_fall(run, until_ms, is_off):
    assert is_seen_off(run(said={"motor_current": lambda since_ns: float(since_ns < until_ms * MS)})) is is_off


def test_readings_that_are_few_are_waited_for(run):
    def every_90_ms(text):
        assert text.count("every: 10 ms") == 1
        return text.replace("every: 10 ms", "every: 90 ms")

    assert is_seen_off(run(ZERO, stock="virtual_uds_data", bench=every_90_ms))


@pytest.mark.parametrize(("quiet", "is_off"), [(9, False), (10, True)])
def test_ten_samples_in_a_row_must_show_no_current(run, quiet, is_off):
    def looked_at_often(text):
        return text.replace("limits:", "command_rate: 1 kHz\nlimits:")  # a sample, a look

    def current(since_ns):
        return float(since_ns // MS % (quiet + 1) == quiet)

    assert is_seen_off(run(said={"motor_current": current}, bench=looked_at_often)) is is_off


@pytest.mark.spoilt
@pytest.mark.parametrize(("late_ms", "is_off"), [(5, True), (50, False)])
def test_samples_from_before_the_last_command_do_not_count(run, late_ms, is_off):
    class Late(Link):
        waiting = None

        def receive(self):
            frames = super().receive()
            frames = frames if self.waiting is None else concatenate_frames([self.waiting, frames])
            due = frames.stamp_ns <= self.now_ns - late_ms * MS
            self.waiting = frames.select(~due)
            return frames.select(due)

    assert is_seen_off(run(ZERO + HOLD + OFF, link=Late)) is is_off


@pytest.mark.parametrize(("zero", "is_off"), [(0.4, True), (-0.4, True), (0.6, False), (-0.6, False), (1.0, False)])
def test_a_current_sensor_is_read_from_its_zero_up_to_half_an_ampere(run, zero, is_off):
    assert is_seen_off(run(zero=zero)) is is_off


class Signalled(Link):
    """A bench that is sent a signal while the plate is held, again and again."""

    number = signal.SIGINT

    def receive(self):
        if self.now_ns > 400 * MS:
            os.kill(os.getpid(), self.number)
        return super().receive()


class Halted(Signalled):
    number = signal.SIGQUIT


def test_a_run_that_was_aborted_stays_aborted_where_the_drive_is_not_seen_off(run):
    head = "retry: {attempts: 2, after: [bench_fault]}\n"
    results = run(link=Signalled, said={"motor_current": constant(1.0)}, head=head)
    assert (results.bench.outcome, results.bench.safe_state, results.exit_code) == ("aborted", False, 5)
    assert results.attempts == ()


@pytest.mark.parametrize(("link", "reason"), [(Signalled, "command"), (Halted, "timeout")])
def test_an_abort_commands_the_drive_off_and_a_halt_leaves_it_to_the_watchdog(run, link, reason):
    results = run(link=link)
    assert (results.bench.outcome, results.bench.safe_state, results.exit_code) == ("aborted", True, 5)
    assert run.drive.switches[-1].reason == reason


def test_a_disk_that_is_full_in_the_safe_stop_keeps_nobody_from_seeing_the_drive_off(run):
    class Filling(Link):
        looks = 0

        def receive(self):
            self.looks += self.drive.is_off
            if self.looks in (2, 3):  # a disk that is full for one look, longer than frames wait to be written
                resource.setrlimit(resource.RLIMIT_FSIZE, ((0, resource.RLIM_INFINITY)[self.looks - 2], -1))
                time.sleep(0.05)
            return super().receive()

    results = run(link=Filling, said={"motor_current": lambda since_ns: float(since_ns < 200 * MS)})
    assert (results.bench.outcome, results.bench.reason_id, results.bench.safe_state) == ("fault", "not_recorded", True)
    assert "raw log cannot be written" in results.bench.reason
    assert (results.unit.verdict, results.exit_code) == (None, 3)


@pytest.mark.parametrize("fails", ["send", "receive"])
def test_what_fails_in_the_safe_stop_leaves_the_drive_commanded_off_and_is_told(run, fails):
    class Failing(Link):
        sent = failed = 0

        def send(self, frames):
            if fails == "send" and self.now_ns > 450 * MS and Failing.failed < 2:
                Failing.failed += 1
                raise ValueError("a bug")
            self.link.send(frames)
            Failing.sent += self.drive.is_off

        def receive(self):
            frames = super().receive()
            if fails == "receive" and self.drive.is_off:
                raise ValueError("a bug")
            return frames

    with pytest.raises(ValueError, match="a bug"):
        run(link=Failing)
    assert run.drive.switches[-1].reason == "command"
    assert Failing.sent > 40  # until patience ends, every 10 ms


def test_a_simulated_controller_that_fails_in_the_safe_stop_ends_the_run(run):
    class Broken:
        def __init__(self, node, drive):
            self.node, self.drive = node, drive

        def run(self, until_ns, inbox):
            if self.drive.is_off:
                raise ValueError("a bug")  # virtual time stands still
            return self.node.run(until_ns, inbox)

    with pytest.raises(ValueError, match="a bug"):
        run(node=Broken)
    assert run.drive.is_off
