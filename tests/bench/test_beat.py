"""One beat after the other on the virtual bench: what is sent, what is refused, how late it is, and who is told."""

import math
import os
import signal
from dataclasses import replace

import pytest
from guards import Guard, guarded_bench

from etb_hil.base.errors import RecordingFault
from etb_hil.base.stock import find
from etb_hil.bench.beat import Beat, RunStopped, StopInOrder
from etb_hil.bench.bench_file import load_bench
from etb_hil.bench.stop_signals import StopSignals
from etb_hil.bench.supervision import TIMEOUT
from etb_hil.bench.tap import Tap
from etb_hil.canio.bus.health import BusState
from etb_hil.canio.bus.link import VirtualLink
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.canio.dbc.commands import CommandEncoder
from etb_hil.canio.logs.blf import BlfLog
from etb_hil.controller.state import Fault
from etb_hil.controller.virtual_controller import VirtualController
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.plant.parameters import load_model
from etb_hil.scenario.condition import Condition
from etb_hil.scenario.trajectory import OFF, SetPoint
from etb_hil.session.analysis import Analysis
from etb_hil.session.events import EventLog, read_events

MS = 1_000_000
TICK = 10 * MS
MODEL = load_model(find("model", "default"))
LIMITS = load_limits(find("limits", "default"))
HERE = SetPoint(OFF.mode.__class__(1), MODEL.values.limp_home)
OUTSIDE = {"role": "supply_voltage", "outside": ("20 V", "24 V"), "for": "0 s"}


class Link:
    """A link to the bench: counts what is sent, and does what a test says when frames are received."""

    def __init__(self, inner):
        self.inner, self.sent, self.at_receive, self.state = inner, 0, [], None

    def send(self, frames):
        self.sent += len(frames)
        self.inner.send(frames)

    def receive(self):
        if self.at_receive:
            self.at_receive.pop(0)()
        frames = self.inner.receive()
        return frames.select(slice(0)) if self.state is not None else frames

    def health(self):
        health = self.inner.health()
        return health if self.state is None else replace(health, state=self.state)

    def close(self):
        self.inner.close()


class Bench:
    """A virtual bench whose controller has woken; one that may live `ahead` counts nothing that is sent."""

    def __init__(
        self, folder, change=lambda text: text, supply=None, spent_ns=0, guard=None, ambient=25.0, ahead=False
    ):
        path, plain = folder / "bench.yaml", find("bench", "virtual_classic")
        path.write_text(change((plain if guard is None else guarded_bench(folder)).read_text()))
        setup = load_bench(path)
        self.bench, bus = setup.bench, setup.bench.bus
        network = VirtualNetwork(int(bus.bitrate), int(bus.data_bitrate), fd=bus.fd)
        self.switches, self.shown, self.folder = [], [], folder
        dialect = load_bench(plain).dialect  # without the guard, which is a node of its own
        tell = None if ahead else self.switches.append
        network.attach(VirtualController(MODEL, dialect, 1, on_switch=tell, ambient=ambient))
        if guard is not None:
            network.attach(guard, answers=False)
        self.clock, self.link = network.clock, VirtualLink(network)
        if not ahead:
            self.link = Link(self.link)
        self.log, self.events = BlfLog(folder / "raw.blf", 0), EventLog(folder / "events.jsonl")
        analysis = Analysis(setup.dialect, MODEL, LIMITS, str(folder), observer=self.bench.observer, bus=bus)
        self.tap = Tap(self.link, CommandEncoder(setup.dialect), analysis, self.log, self.events, self.clock)
        self.signals = StopSignals()
        self.beat = Beat(
            self.bench, self.tap, self.clock, MODEL.values.gear_ratio, signals=self.signals, spent_ns=spent_ns,
            supply=None if supply is None else Condition.model_validate(supply), show=self.shown.append,
        )  # fmt: skip
        assert self.beat.commanded is OFF
        self.tap.request(self.bench.measure)
        self.beat.supervisor.expect(self.bench.measure.signals, self.clock.now_ns())
        while not self.beat.supervisor.has_answered:
            self.beat(OFF, is_waking=True)

    def close(self):
        for part in (self.link, self.log, self.events):
            part.close()

    def stall(self, ns):
        """Have the host stand still when it next receives."""
        self.link.at_receive.append(lambda: self.clock.sleep_until_ns(self.clock.now_ns() + ns))

    def stopped(self, *set_points, **how):
        """Beat until the run is stopped; return why."""
        try:
            for set_point in set_points or [OFF] * 1_000:
                self.beat(set_point, **how)
        except RunStopped as stop:
            return stop
        return pytest.fail("nothing stopped it")


@pytest.fixture
def bench(tmp_path):
    made = []

    def make(**how):
        made.append(Bench(tmp_path, **how))
        return made[-1]

    yield make
    for each in made:
        each.close()


def test_a_beat_sends_one_command_and_lasts_a_tick(bench):
    one = bench()
    begun, sent, before = one.clock.now_ns(), one.link.sent, one.beat.frame_age.waits
    for count, set_point in enumerate((HERE, HERE, OFF), start=1):
        one.beat(set_point)
        assert one.clock.now_ns() == one.beat.next_ns == begun + count * TICK
        assert one.link.sent == sent + count
        assert one.beat.commanded is set_point
    assert one.beat.tick_ns == TICK
    assert [switch.on for switch in one.switches] == [True, False]
    assert one.beat.lateness.worst_ns == 0
    assert one.beat.frame_age.waits == before + 3
    assert 0 < one.beat.frame_age.worst_ns < TICK


def test_while_it_wakes_nothing_is_aged(bench):
    assert bench().beat.frame_age.waits == 0


def test_without_a_set_point_nothing_is_sent_and_the_unit_is_watched(bench):
    one = bench()
    one.beat(HERE)
    sent = one.link.sent
    one.beat(None)
    assert (one.link.sent, one.beat.commanded) == (sent, HERE)
    one.link.state = BusState.ERROR_ACTIVE
    assert one.stopped(*[None] * 50).reason_id == "frames_stopped"


def test_a_watchdog_that_trips_while_nothing_is_sent_on_purpose_is_not_the_hosts_doing(bench):
    one = bench()
    one.beat(HERE)
    assert one.stopped(*[None] * 50).reason_id == "controller_fault"


@pytest.mark.parametrize(("late", "burst"), [(20 * MS, True), (20 * MS + 1, False), (300_000 * 100, False)])
def test_a_stall_is_not_made_up_for_by_a_burst(bench, late, burst):
    one = bench()
    one.stall(late)
    one.beat(OFF)
    stalled = one.clock.now_ns()
    one.beat(OFF)
    assert one.beat.lateness.worst_ns == late - TICK
    one.beat(OFF)
    assert one.clock.now_ns() - stalled == (0 if burst else TICK)
    one.beat(OFF)
    assert one.clock.now_ns() - stalled == (TICK if burst else 2 * TICK)


def test_a_set_point_outside_the_limits_is_not_sent(bench):
    one = bench()
    sent = one.link.sent
    stopped = one.stopped(SetPoint(HERE.mode, 99.0))
    assert (stopped.reason_id, stopped.outcome, one.link.sent) == ("set_point_limit", "fault", sent)
    assert str(stopped) == stopped.reason


@pytest.mark.parametrize("spent_ns", [0, 400 * MS])
def test_a_run_has_its_longest_duration(bench, spent_ns):
    one = bench(spent_ns=spent_ns, change=lambda text: text.replace("duration: 10 min", "duration: 1 s"))
    assert one.bench.limits.duration == 1.0
    stopped = one.stopped()
    assert (stopped.reason_id, stopped.reason) == ("duration_limit", "the run is longer than the limit of 1 s")
    assert one.clock.now_ns() - one.beat.start_ns == 1_000 * MS - spent_ns + TICK


@pytest.mark.parametrize(
    ("name", "reason_id", "reason"),
    [
        ("SIGALRM", "time_out", "the time-out has passed"),
        ("SIGTERM", "aborted_by_operator", "SIGTERM"),
        ("SIGINT", "aborted_by_operator", "key a, Ctrl-C or STOP"),
        ("SIGQUIT", "aborted_by_operator", "SIGQUIT"),
    ],
)
def test_an_order_to_end_is_heeded_before_anything_is_sent(bench, name, reason_id, reason):
    one = bench()
    sent = one.link.sent
    with one.signals:
        os.kill(os.getpid(), getattr(signal, name))
        stopped = one.stopped(HERE)
    assert (stopped.outcome, stopped.reason_id, stopped.reason) == ("aborted", reason_id, reason)
    assert one.link.sent == sent


def test_a_stop_in_order_is_heeded_once(bench):
    one = bench()
    with one.signals:
        os.kill(os.getpid(), signal.SIGUSR1)
        with pytest.raises(StopInOrder):
            one.beat(HERE)
        one.beat.is_ending = True
        one.beat(HERE)
        os.kill(os.getpid(), signal.SIGTERM)
        assert one.stopped(HERE).reason_id == "aborted_by_operator"


@pytest.mark.parametrize("state", [BusState.ERROR_PASSIVE, BusState.BUS_OFF])
def test_frames_that_stop_are_the_bus_where_it_is_off(bench, state):
    one = bench()
    one.link.state = state
    stopped = one.stopped()
    off = state is BusState.BUS_OFF
    assert stopped.reason_id == ("bus_off" if off else "frames_stopped")
    assert stopped.reason.startswith("the CAN interface is bus-off; no measured" if off else "no measured sample")


def test_what_a_stall_does_to_the_watchdog_is_the_hosts_doing(bench):
    one = bench()
    one.beat(HERE)
    one.stall(60 * MS)
    stopped = one.stopped(*[HERE] * 5)
    assert stopped.reason_id == "host_late"
    assert stopped.reason.startswith("the controller's watchdog took the drive off: 70 ms passed")


def test_a_watchdog_that_trips_though_commands_came_in_time_is_the_controllers(bench):
    one = bench()
    one.beat(HERE)
    inner, one.link.inner = one.link.inner, one.link
    one.link.inner = type("Deaf", (), {"send": lambda *_: None, "receive": inner.receive, "close": inner.close})()
    assert one.stopped(*[HERE] * 20).reason_id == "controller_fault"


def test_fault_bits_of_before_are_not_heeded_while_it_wakes(bench):
    one = bench()
    one.beat(HERE)
    one.stall(60 * MS)
    one.beat(HERE, is_waking=True)
    assert one.beat.supervisor.faults
    assert one.stopped(OFF).reason_id == "host_late"


def test_what_the_samples_say_outranks_the_duration(bench):
    one = bench(change=lambda text: text.replace("duration: 10 min", "duration: 1 s"))
    while one.clock.now_ns() < 910 * MS:
        one.beat(OFF)
    one.link.state = BusState.ERROR_PASSIVE
    assert (one.stopped().reason_id, one.clock.now_ns()) == ("frames_stopped", 1_010 * MS)


def test_a_fault_that_is_not_the_watchdogs_is_the_controllers_though_commands_were_late(bench):
    one = bench(ambient=150.0, change=lambda text: text.replace("temperature: 110 degC", "temperature: 200 degC"))
    one.stall(25 * MS)
    one.beat(OFF, is_waking=True)
    stopped = one.stopped(OFF)
    assert (stopped.reason_id, one.beat.supervisor.faults) == ("controller_fault", int(Fault.OVER_TEMPERATURE))


def test_a_late_host_is_no_excuse_for_a_limit_that_is_passed_meanwhile(bench):
    """The watchdog has let the plate fall, which becomes too fast while the drive is commanded on."""
    one = bench(change=lambda text: text.replace("velocity: 35 rad/s", "velocity: 6 rad/s"))
    for degrees in range(8, 60):
        one.beat(SetPoint(HERE.mode, math.radians(degrees)))
    one.stall(35 * MS)
    while abs(one.beat.supervisor.velocity) < 5.0:
        one.beat(SetPoint(HERE.mode, math.radians(59)), is_waking=True)
    assert one.beat.supervisor.faults & TIMEOUT
    assert one.stopped(SetPoint(HERE.mode, math.radians(59))).reason_id == "velocity_limit"


def test_a_plate_falls_as_fast_as_its_springs_make_it_and_is_not_caught_at_that_speed(bench):
    """From 60 deg it comes to 17 rad/s, and 9 deg below limp-home, as at any stop."""
    one = bench(change=lambda text: text.replace("velocity: 35 rad/s", "velocity: 6 rad/s").replace("-3 deg", "5 deg"))

    def release(beats):
        for degrees in range(8, 60):
            one.beat(SetPoint(HERE.mode, math.radians(degrees)))
        for _ in range(beats):
            one.beat(OFF)

    release(100)
    release(6)
    assert abs(one.beat.supervisor.velocity) > 6.0
    assert one.stopped(SetPoint(HERE.mode, one.beat.supervisor.angle)).reason_id == "velocity_limit"


def test_an_open_interlock_is_no_matter_until_something_moves(bench):
    one = bench(guard=Guard(0.0))
    one.beat(OFF)
    sent = one.link.sent
    assert (one.stopped(HERE).reason_id, one.link.sent) == ("interlock_open", sent)
    assert not one.switches


def test_an_interlock_that_opens_while_something_moves_stops_the_run_within_the_beat(bench):
    """Every second beat moves: of two instants to open a beat apart, one is in a beat that moves."""
    last = set()
    for opens in (0.5, 0.51):
        one = bench(guard=Guard(opens))
        assert one.stopped(*[HERE, OFF] * 50).reason_id == "interlock_open"
        last.add(one.beat.commanded)
    assert last == {HERE, OFF}


def test_a_late_host_outranks_an_interlock_that_opens_meanwhile(bench):
    guard = Guard(1e9)
    one = bench(guard=guard)
    one.beat(HERE)
    guard.opens = one.clock.now_ns() * 1e-9 + 0.02
    one.stall(60 * MS)
    assert one.stopped(HERE).reason_id == "host_late"


def test_a_supply_outside_its_window_is_no_matter_until_something_moves(bench):
    one = bench(supply=OUTSIDE)
    one.beat(OFF)
    sent = one.link.sent
    stopped = one.stopped(HERE)
    assert (stopped.reason_id, one.link.sent) == ("supply_window", sent)
    assert "outside 20 to 24 V" in stopped.reason
    assert one.stopped(None).reason_id == "supply_window"
    first, _ = [event for event in read_events(one.folder / "events.jsonl") if event.event == "supply"]
    assert first.details["value"] == pytest.approx(13.5, abs=0.3)
    assert 0 < first.stamp_ns <= one.clock.now_ns()
    assert "supply_voltage" in first.details["condition"]
    assert not one.switches


def test_a_supply_that_leaves_its_window_stops_the_run_within_the_beat(bench):
    one = bench(supply={"role": "supply_voltage", "outside": ("20 V", "24 V"), "for": "200 ms"})
    begun = one.clock.now_ns()
    assert one.stopped(*[HERE] * 100).reason_id == "supply_window"
    assert one.clock.now_ns() - begun < 200 * MS
    assert one.switches[-1].on


def test_frames_that_cannot_be_kept_end_the_run(bench, monkeypatch):
    one = bench()

    def full(*_):
        raise RecordingFault("no room")

    monkeypatch.setattr(BlfLog, "write", full)
    with pytest.raises(RecordingFault, match="no room"):
        one.beat(OFF)


@pytest.mark.parametrize(("rate", "tick_us", "every_ms"), [(100, 10_000, 130), (80, 12_500, 125)])
def test_a_watcher_is_told_eight_times_a_second(bench, rate, tick_us, every_ms):
    one = bench(change=lambda text: f"{text}command_rate: {rate} Hz\n")
    assert one.shown[0] == one.beat.start_ns + 1_000 * tick_us
    for _ in range(40):
        one.beat(OFF)
    assert {b - a for a, b in zip(one.shown, one.shown[1:], strict=False)} == {every_ms * MS}


def kept(one):
    """Return all that a beat changes and anybody may read."""
    beat, seen = one.beat, one.beat.supervisor
    return (
        one.clock.now_ns(), beat.next_ns, beat.commanded, replace(beat.lateness), replace(beat.frame_age), [*one.shown],
        seen.newest_ns, seen.angle, seen.current, seen.velocity, seen.enabled, seen.faults,
    )  # fmt: skip


@pytest.mark.parametrize("supply", [None, {"role": "supply_voltage", "outside": ("8 V", "20 V"), "for": "0 s"}])
def test_beats_that_are_lived_ahead_are_as_one_after_the_other(bench, supply):
    ahead, single = (bench(ahead=which, supply=supply) for which in (True, False))
    for one in (ahead, single):
        one.beat(HERE)
        while one.beat.supervisor.enabled is not True:
            one.beat(HERE)
        one.shown.clear()
    lived = []
    while sum(lived) < 60:
        count = max(ahead.beat.room(), 1)
        if count > 1:
            assert ahead.beat.ahead([HERE] * count)
            lived.append(count)
        else:
            ahead.beat(HERE)
        for _ in range(count):
            single.beat(HERE)
        assert kept(ahead) == kept(single)
    assert max(lived) > 5
    assert ahead.shown


def test_a_late_host_is_late_since_the_last_command_that_was_sent_ahead(bench):
    one = bench(ahead=True)
    one.beat(HERE)
    while one.beat.room() < 2:
        one.beat(HERE)
    assert one.beat.ahead([HERE] * one.beat.room())
    one.clock.sleep_until_ns(one.clock.now_ns() + 60 * MS)
    stopped = one.stopped(*[HERE] * 5)
    assert stopped.reason_id == "host_late"
    assert stopped.reason.startswith("the controller's watchdog took the drive off: 70 ms passed")


def test_there_is_no_room_where_each_beat_needs_a_call(bench):
    assert bench().beat.room() == 0  # its controller tells of its switches
    one = bench(ahead=True)
    assert 1 < one.beat.room() <= 13  # the watcher is told every 0.125 s
    one.clock.sleep_until_ns(one.clock.now_ns() + MS)
    assert one.beat.room() == 0
    assert bench(ahead=True, change=lambda text: text.replace("duration: 10 min", "duration: 40 ms")).beat.room() < 4


def test_an_interlock_is_heard_beat_by_beat(bench, tmp_path):
    guarded = guarded_bench(tmp_path).read_text("utf-8")
    assert bench(ahead=True, change=lambda _: guarded).beat.room() == 0


@pytest.mark.parametrize(
    "set_points",
    [
        [OFF, HERE],  # it switches the bridge
        [HERE, HERE],
    ],
)
def test_set_points_that_cannot_be_lived_ahead_change_nothing(bench, set_points):
    one = bench(ahead=True)
    before = kept(one)
    assert not one.beat.ahead(set_points)
    assert kept(one) == before


def test_a_set_point_outside_the_limits_is_not_sent_ahead(bench):
    one = bench(ahead=True)
    while one.beat.supervisor.enabled is not True:
        one.beat(HERE)
    before = kept(one)
    assert not one.beat.ahead([HERE, SetPoint(HERE.mode, math.radians(88.0)), HERE])
    assert kept(one) == before
    assert one.beat.ahead([HERE, HERE])


def test_after_beats_that_could_not_be_lived_ahead_each_has_a_call(bench):
    one = bench(ahead=True)
    assert not one.beat.ahead([OFF, OFF, HERE])
    for _ in range(3):
        assert one.beat.room() == 0
        one.beat(OFF)
    while one.clock.now_ns() % (130 * MS) == 0:  # a watcher is told
        one.beat(OFF)
    assert one.beat.room() > 0
    assert not one.beat.ahead([HERE])  # its first beat switches the bridge
    assert one.beat.room() > 0


def test_samples_that_stop_are_not_lived_ahead(bench):
    one = bench(ahead=True)
    one.tap.request(one.bench.measure.model_copy(update={"signals": ("current",)}))
    one.beat(OFF)
    before = kept(one)
    assert not one.beat.ahead([OFF] * 12)
    assert kept(one) == before
    assert one.stopped().reason_id == "frames_stopped"


def test_a_supply_outside_its_window_is_not_lived_ahead(bench):
    one = bench(ahead=True, supply=OUTSIDE)
    before = kept(one)
    assert not one.beat.ahead([OFF] * 5)
    assert kept(one) == before


def test_an_order_to_end_is_heeded_before_anything_is_lived_ahead(bench):
    one = bench(ahead=True)
    before = kept(one)
    with one.signals:
        os.kill(os.getpid(), signal.SIGUSR1)
        with pytest.raises(StopInOrder):
            one.beat.ahead([OFF] * 5)
    assert kept(one) == before
